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

Field = NDArray[np.float64]

_REACH = 4
_BELL = np.exp(-0.5 * np.arange(_REACH + 1.0) ** 2)
GAUSSIAN = _BELL / (_BELL[0] + 2.0 * _BELL[1:].sum())
"""Weights of a normal distribution one cell wide, from its middle on one side."""


def smoothed(field: Field, weights: Sequence[float] | FloatArray, beyond: str) -> Field:
    """Averages along one axis after the other.

    ``weights``  from the middle on one side; the other side has the same.
    ``beyond``   the grid: ``constant`` for zeros, ``symmetric`` for its mirror image.
    """
    for axis in range(field.ndim):
        field = _smoothed_along(field, weights, beyond, axis)
    return field


def _smoothed_along(
    field: Field, weights: Sequence[float] | FloatArray, beyond: str, axis: int
) -> Field:
    reach, count = len(weights) - 1, field.shape[axis]
    widths = [(reach, reach) if i == axis else (0, 0) for i in range(field.ndim)]
    padded = np.moveaxis(np.pad(field, widths, mode=beyond), axis, 0)  # type: ignore[call-overload]
    total = padded[reach : reach + count] * weights[0]
    for step in range(reach, 0, -1):  # from the outer ones, so that the sum is always the same
        pair = padded[reach - step : reach - step + count] + padded[reach + step :][:count]
        total += pair * weights[step]
    return np.moveaxis(total, 0, axis)


def depths_in(cells: BoolArray) -> Field:
    """Distance of each cell's centre to that of the nearest cell that is not set, or off the grid.

    ``cells`` (nx, ny, nz); 0 where a cell is not set.
    """
    free = np.pad(~cells, 1, constant_values=True)
    squares = squared_distances(free, 0)[1:-1, 1:-1, 1:-1]
    return np.asarray(0.5 * np.sqrt(squares.astype(np.float64)))  # those are of half cells
