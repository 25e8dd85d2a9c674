"""Averages along an axis of a field."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel


@kernel("float64[:, :, :], float64[:], bool, int64, int64, int64, float64[:, :, :]")
def smooth_planes(field, weights, mirrored, axis, begin, end, total):
    """Fill the planes ``begin:end`` of ``total`` with averages of a ``field`` along an axis.

    ``weights``   (r + 1,) float64, from the middle on one side; the other side has the same.
    ``mirrored``  whether the field goes on as its mirror image beyond its ends; else by zeros.

    Pairs of neighbours are added from the outer ones on, so that the sum is always the same.
    """
    rows, row = field.shape[1], field.shape[2]
    reach = len(weights) - 1
    nothing, padded = np.zeros(row), np.zeros(row + 2 * reach)
    for i in range(begin, end):
        for j in range(rows):
            own, out = field[i, j], total[i, j]
            if axis == 2:
                padded[reach : reach + row] = own
                if mirrored:
                    for step in range(1, reach + 1):
                        padded[reach - step] = own[_mirrored(-step, row)]
                        padded[reach + row - 1 + step] = own[_mirrored(row - 1 + step, row)]
            for k in range(row):
                out[k] = own[k] * weights[0]
            for step in range(reach, 0, -1):
                if axis == 2:
                    _add_pair(padded[reach - step :], padded[reach + step :], weights[step], out)
                else:
                    before = _line(field, i, j, axis, -step, mirrored, nothing)
                    after = _line(field, i, j, axis, step, mirrored, nothing)
                    _add_pair(before, after, weights[step], out)


@inner_kernel
def _add_pair(before, after, weight, total):
    for k in range(len(total)):
        total[k] += (before[k] + after[k]) * weight


@inner_kernel
def _line(field, i, j, axis, step, mirrored, nothing):
    """The line (nz,) that lies a step away along the first or the second axis."""
    place, count = (i if axis == 0 else j) + step, field.shape[axis]
    if place < 0 or place >= count:
        if not mirrored:
            return nothing
        place = _mirrored(place, count)
    return field[place, j] if axis == 0 else field[i, place]


@inline_kernel
def _mirrored(place, count):
    """Which of so many a place beyond their ends mirrors, in turn there and back."""
    place %= 2 * count
    return min(place, 2 * count - 1 - place)
