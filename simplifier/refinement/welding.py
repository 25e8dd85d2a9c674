"""TriangleMesh -> surface: equal positions are one vertex, and no face comes twice."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.grid import VoxelGrid
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh


def welded(mesh: TriangleMesh, grid: VoxelGrid) -> tuple[FloatArray, IntArray]:
    """``vertices`` (n, 3) float64 in grid space and ``faces`` (m, 3) int32 in the input's order.

    Exact, unlike :func:`~.clustering.clustered`: only what coincides is joined.
    """
    points, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    faces = place.reshape(-1).astype(np.int32)[mesh.faces]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return grid.to_grid(points), np.ascontiguousarray(faces[np.sort(first)])
