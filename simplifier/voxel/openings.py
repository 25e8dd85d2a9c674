"""Regions to leave open -> the voxels that no triangle may touch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simplifier.geometry.grid import BoolArray, VoxelGrid
from simplifier.geometry.region import Region

SLACK = 1e-3
"""Voxels that a barred voxel may be away from its region: formats that round to 32 bits move
corners, and must not move them into it."""


def barred(grid: VoxelGrid, regions: Sequence[Region], margin: int = 0) -> BoolArray:
    """(nx + 2 m, ny + 2 m, nz + 2 m): the voxels, ``margin`` m layers about the grid included, that
    come within :data:`SLACK` of a region.
    """
    closed = np.zeros([length + 2 * margin for length in grid.shape], dtype=np.bool_)
    half = grid.cell_size * (0.5 + SLACK)
    for region in regions:
        reach = np.abs(region.axes).T @ region.half
        ends = grid.to_grid(np.stack([region.centre - reach, region.centre + reach])) + margin
        low = np.clip(np.floor(ends[0]) - 1, 0, closed.shape).astype(np.int64)
        high = np.clip(np.ceil(ends[1]) + 1, 0, closed.shape).astype(np.int64)
        for layer in range(low[0], high[0]):  # one at a time, for the memory of fine grids
            near = closed[layer, low[1] : high[1], low[2] : high[2]]
            rows, columns = np.indices(near.shape).reshape(2, -1)
            places = np.stack([np.full(len(rows), layer), rows + low[1], columns + low[2]], axis=1)
            centres = grid.to_world(places + (0.5 - margin))
            near |= region.meets_boxes(centres, half).reshape(near.shape)
    return closed


def opened(grid: VoxelGrid, regions: Sequence[Region]) -> VoxelGrid:
    """The solid without its barred voxels."""
    return grid.with_inside(grid.inside & ~barred(grid, regions)) if regions else grid
