"""Does the outside reach into a shape that looks as if it should enclose something?"""

from __future__ import annotations

import numpy as np

from simplifier.geometry.grid import VoxelGrid
from simplifier.kernels.leaks import count_hollow

_ENCLOSED = 0.02  # enclosed voxels, as a share of the touched ones, below which little is inside
_SIDES = 5  # of six, that have the surface in sight: one may be what is open
_HOLLOW = 0.5  # hollow voxels, likewise, above which much should be inside


def leaks(touched: VoxelGrid, filled: VoxelGrid) -> bool:
    """True when the fill found next to nothing inside though the shape is hollow.

    A box without a lid has many hollow voxels, a flat sheet or a terrain few.
    """
    enclosed = filled.count - touched.count
    if enclosed > _ENCLOSED * touched.count:
        return False
    return hollow_count(touched) > _HOLLOW * touched.count


def hollow_count(touched: VoxelGrid) -> int:
    """Free voxels that see the surface along at least five of the six axis directions."""
    return int(count_hollow(np.ascontiguousarray(touched.inside), _SIDES))
