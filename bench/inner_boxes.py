"""Axis-aligned boxes inside of a mesh, the plainest of inner occluders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import VoxelGrid
from simplifier.visibility.strong.inner_boxes import placed_boxes

Faces = NDArray[np.int64]

TRIANGLES = 12  # of a box
_FACES = np.array([
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [1, 5, 7], [1, 7, 3], [0, 2, 6], [0, 6, 4],
], dtype=np.int64)  # corners numbered 4 x + 2 y + z  # fmt: skip


def inner_boxes(grid: VoxelGrid, count: int) -> tuple[FloatArray, Faces]:
    """The surfaces of at most ``count`` boxes of voxels that are inside, in the grid's world."""
    ends = placed_boxes(grid.inside, count)
    corner = np.arange(8)
    columns = [ends[:, (corner >> bit) & 1, axis] for axis, bit in enumerate((2, 1, 0))]
    points = grid.to_world(np.stack(columns, axis=-1).reshape(-1, 3).astype(np.float64))
    faces = _FACES[None] + 8 * np.arange(len(ends))[:, None, None]
    return points, faces.reshape(-1, 3)
