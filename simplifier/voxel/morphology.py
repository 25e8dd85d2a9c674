"""VoxelGrid -> voxels: solids grown by a voxel."""

from __future__ import annotations

import numpy as np

from simplifier.geometry.grid import BoolArray, VoxelGrid

_MARGIN = 2  # voxels: one for the growth, one that stays free


def dilated(grid: VoxelGrid) -> tuple[BoolArray, float]:
    """The solid and all voxels that touch it, even at a corner, in a larger array.

    Returns (nx + 4, ny + 4, nz + 4) bool and the margin: a point p of grid space lies in voxel
    floor(p + margin).  The outermost layer is never set.
    """
    grown = np.pad(grid.inside, _MARGIN)
    for axis in range(3):
        # Growing along one axis after the other takes in all 26 neighbours.
        once = grown.copy()
        ahead = tuple(slice(1, None) if i == axis else slice(None) for i in range(3))
        behind = tuple(slice(None, -1) if i == axis else slice(None) for i in range(3))
        once[ahead] |= grown[behind]
        once[behind] |= grown[ahead]
        grown = once
    return grown, float(_MARGIN)
