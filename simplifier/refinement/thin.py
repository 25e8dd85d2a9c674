"""TriangleMesh -> TriangleMesh: fewer triangles that look the same in small pictures.

A scan has tens of triangles a voxel, and drawing them all takes longer than the search does.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.thin import border_places, crack_triangles, gather_first, whole_faces

CELLS = 192
"""Along the longest edge: a third of a pixel of a picture, so outlines shrink by less than that."""

_LEAST = 50_000  # triangles below which drawing them all takes no longer


def thinned(mesh: TriangleMesh) -> TriangleMesh:
    """What is left when one vertex stands for all in its cell, a 192nd of the longest edge wide.

    Corners stay on the surface, so outlines do not grow, and a closed surface stays closed (vertex
    clustering), one with T-junctions too: flat triangles close these.  A mesh of few faces is
    returned as it is, and one that nothing would be left of.
    """
    vertices, faces = mesh.vertices, mesh.faces
    if len(faces) < _LEAST:
        return mesh
    low, high = mesh.bounds
    step = float((high - low).max()) / CELLS
    numbers = np.zeros(((high - low) / step).astype(np.int64) + 1, dtype=np.int32)
    points, chosen = np.empty_like(vertices), np.empty(len(vertices), dtype=np.int32)
    count = gather_first(vertices, low, step, numbers, points, chosen)
    left = whole_faces(faces, chosen)
    if len(left) == 0:
        return mesh
    cracks, border = np.empty((0, 3), dtype=np.int32), border_places(left, count)
    if border.any():
        # Slits of T-junctions would be looked through, and nothing behind them seems hidden.
        cracks = crack_triangles(vertices, low, step, faces, chosen, numbers, border)
    return TriangleMesh(points[:count].copy(), np.concatenate([left, chosen[cracks]]))
