"""Numbers in the cells of a grid: smoothed, read between cells, and how deep a cell lies.

What scipy's images do, to the last bit on the machines that this was tried on; importing those
takes longer than most searches.
"""

from __future__ import annotations

import itertools
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


def read_between(field: Field, points: FloatArray) -> FloatArray:
    """The values at ``points`` (3, q) by trilinear interpolation; cell (i, j, k) is at (i, j, k).

    Off the grid, that of the nearest point of it.
    """
    places, shares = [], []
    for axis, count in enumerate(field.shape):
        low = np.floor(points[axis])
        share = points[axis] - low
        first = low.astype(np.int64)
        places.append([np.clip(one, 0, count - 1) for one in (first, first + 1)])
        shares.append((1.0 - share, share))
    total = np.zeros(points.shape[1])
    for ends in itertools.product((0, 1), repeat=3):
        value = field[tuple(place[end] for place, end in zip(places, ends, strict=True))]
        for axis, end in enumerate(ends):
            value = value * shares[axis][end]
        total += value
    return total
