"""Numbers in the cells of a grid: smoothed, and how deep a cell lies.

What scipy's images do, to the last bit on the machines that this was tried on; importing those
takes longer than most searches.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.morphology import squared_distances
from simplifier.kernels.smoothing import smooth_planes
from simplifier.kernels.threads import run_chunks

Field = NDArray[np.float64]

_REACH = 4
_BELL = np.exp(-0.5 * np.arange(_REACH + 1.0) ** 2)
GAUSSIAN = _BELL / (_BELL[0] + 2.0 * _BELL[1:].sum())
"""Weights of a normal distribution one cell wide, from its middle on one side."""


def smoothed(field: Field, weights: Sequence[float] | FloatArray, beyond: str) -> Field:
    """(nx, ny, nz) averages along one axis after the other.

    ``weights``  from the middle on one side; the other side has the same.
    ``beyond``   the grid: ``constant`` for zeros, ``symmetric`` for its mirror image.
    """
    sides = np.asarray(weights, dtype=np.float64)
    for axis in range(field.ndim):
        field = _smoothed_along(np.ascontiguousarray(field), sides, beyond == "symmetric", axis)
    return field


def _smoothed_along(field: Field, weights: FloatArray, mirrored: bool, axis: int) -> Field:
    total = np.empty_like(field)
    run_chunks(
        lambda begin, end: smooth_planes(field, weights, mirrored, axis, begin, end, total),
        len(field),
        least=max(_LEAST_CELLS // field[0].size, 1),
    )
    return total


_LEAST_CELLS = 1 << 18  # fewer are not worth a hand-over to another thread


def depths_in(cells: BoolArray) -> Field:
    """Distance of each cell's centre to that of the nearest cell that is not set, or off the grid.

    ``cells`` (nx, ny, nz); 0 where a cell is not set.
    """
    free = np.pad(~cells, 1, constant_values=True)
    squares = squared_distances(free, 0)[1:-1, 1:-1, 1:-1]
    return np.asarray(0.5 * np.sqrt(squares.astype(np.float64)))  # those are of half cells
