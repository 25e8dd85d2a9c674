"""64 x 64 pixel images as 64 rows of 64 bits: draw polygons, measure occlusion.

Bit c of row r is the pixel in column c; its centre is (c + 0.5, r + 0.5).  The occlusion measure of
such an image takes about a twentieth of a microsecond, some hundred times less than a distance
transform.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.intrinsic import intrinsic
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel

SIZE = 64


@intrinsic(lambda builder, word: builder.ctpop(word))
def popcount(word: np.uint64) -> np.uint64:
    """Number of ones of a uint64, by the processor's instruction."""
    return np.uint64(int(word).bit_count())


@inline_kernel
def lowest_one(word):
    """The lowest one of a uint64 that is not 0, as a word of its own, and its place, an int64."""
    lowest = word & (~word + np.uint64(1))
    return lowest, np.int64(popcount(lowest - np.uint64(1)))


@inline_kernel
def upright_edge(x0, y0, x1, y1):
    """An edge as :func:`edge_bits` takes it, from either end.

    Half a pixel left of the upper end, that end's height, how far it goes to the right a row, the
    first row whose centre it passes, and the one after the last, all float64.  Without a branch:
    which end is upper is as good as chance, and a wrong guess of the processor's takes longer.
    """
    upper_x, lower_x = (x1, x0) if y0 > y1 else (x0, x1)
    upper_y, lower_y = min(y0, y1), max(y0, y1)
    first = np.ceil(max(upper_y, 0.0) - 0.5)
    last = np.ceil(min(lower_y, 64.0) - 0.5)
    slope = (lower_x - upper_x) / (lower_y - upper_y)
    passes = first < last
    return upper_x - 0.5, upper_y, slope if passes else 0.0, first, last if passes else first


@inline_kernel
def edge_bits(edge, row):
    """The pixels of a row with their centre right of an edge; none where it does not pass.

    Without a branch, so that a loop over all rows works on several at once.
    """
    start, top, slope, first, last = edge
    # From the end of the edge: the slope of a nearly level one is huge.
    column = np.ceil(start + (row + 0.5 - top) * slope)
    return right_of(column) if (row >= first) & (row < last) else np.uint64(0)


@inline_kernel
def right_of(column):
    """The pixels of a row from a column on, a whole number."""
    there = column < 64.0
    shift = max(column, 0.0) if there else 0.0
    return ~np.uint64(0) << np.uint64(shift) if there else np.uint64(0)


@inner_kernel
def draw_edge(x0, y0, x1, y1, image):
    """Flip, in every row whose centre the edge passes, all pixels with their centre right of it.

    ``image`` (64,) uint64.  All edges of a ring, drawn so, leave exactly the pixels inside
    (even-odd): the scan conversion of polygons by exclusive or.  Edges that run there and back, as
    bridges to holes do, cancel.
    """
    edge = upright_edge(x0, y0, x1, y1)
    if edge[3] < edge[4]:
        for row in range(int(edge[3]) & ~7, (int(edge[4]) + 7) & ~7):
            image[np.uint64(row)] ^= edge_bits(edge, row)


STEPS = "+x+x+"
"""Erosions in turn, by the 5-pixel cross and the 3 x 3 square: their sum is an octagon, close to a
disc of radius one a step."""


def _write_measure(builder: Any, address: Any) -> Any:
    from simplifier.kernels.compiled.erosion import write_measure  # with llvmlite

    return write_measure(builder, address, STEPS)


@intrinsic(_write_measure)
def _measure_twice(image: NDArray[np.uint64]) -> np.uint64:
    rows = image[:64]
    total, step = np.bitwise_count(rows).sum(dtype=np.uint64), 0
    while rows.any():
        upright = np.append(rows[1:], np.uint64(0)) & np.append(np.uint64(0), rows[:-1])
        wide = rows & upright if STEPS[step % len(STEPS)] == "x" else rows
        rows = rows & upright & (wide << np.uint64(1)) & (wide >> np.uint64(1))
        total += np.uint64(2) * np.bitwise_count(rows).sum(dtype=np.uint64)
        step += 1
    return np.uint64(total)


@inner_kernel
def measure_twice(image):
    """Twice the occlusion measure of a bit image, as a whole number of pixels.

    Equation (1) of the paper by the trapezoid rule: the areas left after 0, 1, 2, … erosions, the
    first one counted half.  ``image`` (64,) uint64 or more, of which the rest is not looked at;
    outside the image is background.
    """
    return np.int64(_measure_twice(image))
