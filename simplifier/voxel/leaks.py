"""Does the outside reach into a shape that looks as if it should enclose something?"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.grid import BoolArray, VoxelGrid

_ENCLOSED = 0.02  # enclosed voxels, as a share of the touched ones, below which little is inside
_HULL = 1.0  # free voxels between surfaces along every axis, likewise, above which much should be


def leaks(touched: VoxelGrid, filled: VoxelGrid) -> bool:
    """True when the fill found next to nothing inside though the shape's hull is large.

    The hull counts free voxels that have the surface on both sides along all three axes: an open
    box has many, a flat sheet or a terrain few.
    """
    enclosed = filled.count - touched.count
    if enclosed > _ENCLOSED * touched.count:
        return False
    hull = ~touched.inside
    for axis in range(3):
        hull &= _between(touched.inside, axis)
    return bool(np.count_nonzero(hull) > _HULL * touched.count)


def _between(inside: BoolArray, axis: int) -> BoolArray:
    below = np.logical_or.accumulate(inside, axis=axis)
    above = np.flip(np.logical_or.accumulate(np.flip(inside, axis), axis=axis), axis)
    return np.asarray(below & above)
