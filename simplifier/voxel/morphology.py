"""Voxels -> voxels: solids grown by whole voxels."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.solid import BoolArray, VoxelGrid


def dilate(grid: VoxelGrid, reach: int) -> tuple[BoolArray, float]:
    """The solid and all voxels within ``reach`` of it, even across corners, in a larger array.

    Returns the (nx + 2 m, ny + 2 m, nz + 2 m) bool array and the margin m = ``reach`` + 1: a point
    p of grid space lies in voxel floor(p + m).  The outermost layer is never set.
    """
    margin = reach + 1
    grown = np.pad(grid.inside, margin)
    for _ in range(reach):
        grown = with_neighbours(grown)
    return grown, float(margin)


def with_neighbours(voxels: BoolArray) -> BoolArray:
    """Those that are set and all next to them, even across corners, in an array of that size."""
    for axis in range(3):
        # Growing along one axis after the other takes in all 26 neighbours.
        once = voxels.copy()
        ahead = tuple(slice(1, None) if i == axis else slice(None) for i in range(3))
        behind = tuple(slice(None, -1) if i == axis else slice(None) for i in range(3))
        once[ahead] |= voxels[behind]
        once[behind] |= voxels[ahead]
        voxels = once
    return voxels


def glue_neighbours(grid: VoxelGrid) -> VoxelGrid:
    """The solid and all voxels of the same grid next to it, even across corners."""
    return grid.with_inside(with_neighbours(grid.inside))
