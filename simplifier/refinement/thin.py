"""TriangleMesh -> TriangleMesh: fewer triangles that look the same in small pictures.

A scan has tens of triangles a voxel, and drawing them all takes longer than the search does.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.thin import border_places, crack_triangles, gather_first, whole_faces

FINE = 192
"""Cells along the longest edge, each a third of a pixel of the search's pictures."""

COARSE = 144
"""For a draft: just over half of the triangles, which hide as much where a surface is closed.  The
border of an open one is drawn in by up to a cell, and a terrain's costs it two points of recall."""

_LEAST = 50_000  # triangles below which drawing them all takes no longer


def thinned(mesh: TriangleMesh, cells: int) -> TriangleMesh:
    """What is left when one vertex stands for all in its cell, of so many along the longest edge.

    Outlines shrink by less than a cell.  Corners stay on the surface, so outlines do not grow, and
    a closed surface stays closed (vertex clustering), one with T-junctions too: flat triangles
    close these.  A mesh of few faces is returned as it is, and one that nothing would be left of.
    """
    vertices, faces = mesh.vertices, mesh.faces
    if len(faces) < _LEAST:
        return mesh
    low, high = mesh.bounds
    step = float((high - low).max()) / cells
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
