"""TriangleMesh -> TriangleMesh: fewer triangles that look the same in small pictures.

A scan has tens of triangles a voxel, and drawing them all takes longer than the search does.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import TriangleMesh
from simplifier.kernels.thin import border_places, crack_triangles, gather_points, whole_faces

FINE, COARSE = 192, 144
"""Cells along the longest edge.  Fine ones are a third of a pixel of the search's pictures; coarse
ones leave just over half as many triangles of a scan, to be drawn for a draft."""

_LEAST = 50_000  # triangles below which drawing them all takes no longer


def thinned(mesh: TriangleMesh, *, coarsely: bool = False) -> TriangleMesh:
    """What is left when one vertex stands for all in its cell of a lattice.

    Outlines shrink by less than a cell.  Corners stay on the surface, so outlines do not grow, and
    a closed surface stays closed (vertex clustering), one with T-junctions too: flat triangles
    close these.  A mesh of few faces is returned as it is, and one that nothing would be left of.

    ``coarsely``  in larger cells.  So that outlines shrink by as little there, it is not the first
                  vertex of a cell that stands for all, but the one that is furthest from the middle
                  of the box.  Of a sheet these are peaks, and its border is drawn in.
    """
    vertices, faces = mesh.vertices, mesh.faces
    if len(faces) < _LEAST:
        return mesh
    low, high = mesh.bounds
    step = float((high - low).max()) / (COARSE if coarsely else FINE)
    numbers = np.zeros(((high - low) / step).astype(np.int64) + 1, dtype=np.int32)
    points, chosen = np.empty_like(vertices), np.empty(len(vertices), dtype=np.int32)
    middle, reach = 0.5 * (high - low) / step, np.empty(len(vertices))
    count = gather_points(
        vertices, low, step, middle, coarsely, numbers, points, reach, chosen
    )  # fmt: skip
    left = whole_faces(faces, chosen)
    if len(left) == 0:
        return mesh
    cracks, border = np.empty((0, 3), dtype=np.int32), border_places(left, count)
    if border.any():
        # Slits of T-junctions would be looked through, and nothing behind them seems hidden.
        cracks = crack_triangles(vertices, low, step, faces, chosen, numbers, border)
    return TriangleMesh(points[:count].copy(), np.concatenate([left, chosen[cracks]]))
