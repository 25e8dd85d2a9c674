"""Voxels -> shares: a solid in few cells, for work that need not be as fine as its grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.grid import BoolArray

_CELLS = 64  # along the longest edge, about


def coarse(inside: BoolArray) -> tuple[NDArray[np.float64], int]:
    """(nx, ny, nz) bool to the share of each cell that is inside, and a cell's edge in voxels.

    A cell is a voxel in grids of up to 95 a side.  Cells at the upper ends may reach past the grid,
    which counts as outside.
    """
    size = max(1, round(max(inside.shape) / _CELLS))
    if size == 1:
        return inside.astype(np.float64), 1
    padded = np.pad(inside, [(0, -n % size) for n in inside.shape])
    nx, ny, nz = (n // size for n in padded.shape)
    blocks = padded.reshape(nx, size, ny, size, nz, size)
    return np.asarray(blocks.mean(axis=(1, 3, 5), dtype=np.float64)), size
