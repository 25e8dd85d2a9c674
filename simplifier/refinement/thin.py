"""Triangles -> fewer triangles that look the same in small pictures.

A scan has tens of triangles a voxel, and drawing them all takes longer than the search does.
"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.kernels.thin import crack_triangles, gather_first, has_border, keep_whole

CELLS = 192
"""Along the longest edge: a third of a pixel of a picture, so outlines shrink by less than that."""

_LEAST = 50_000  # triangles below which drawing them all takes no longer


def thin_for_pictures(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, IntArray]:
    """Vertices (p, 3) and faces (k, 3) that are left when one vertex stands for all in its cell.

    ``vertices`` (n, 3), ``faces`` (m, 3) int32; cells are a 192nd of the longest edge.  Corners
    stay on the surface, so outlines do not grow, and a closed surface stays closed (vertex
    clustering), one with T-junctions too.  Few faces are returned as they are.
    """
    if len(faces) < _LEAST:
        return vertices, faces
    # By column: a reduction of (n, 3) along its long axis takes numpy ten times as long.
    low = np.array([column.min() for column in vertices.T])
    extent = np.array([column.max() for column in vertices.T]) - low
    step = float(extent.max()) / CELLS
    numbers = np.full(tuple((extent / step).astype(np.int64) + 1), -1, dtype=np.int32)
    points, chosen = np.empty_like(vertices), np.empty(len(vertices), dtype=np.int32)
    count = gather_first(vertices, low, step, numbers, points, chosen)
    kept = np.empty((len(faces), 3), dtype=np.int32)
    whole = keep_whole(np.array(faces), chosen, kept)
    left = kept[:whole]
    if has_border(left):
        # Slits of T-junctions would be looked through, and nothing behind them seems hidden.
        placed = vertices - low
        placed /= step
        cracks = crack_triangles(placed, faces, chosen)
        left = np.concatenate([left, chosen[cracks]])
    return points[:count], left
