"""Pixels that an occluder covers beside the original: how many, and how far out.

Masks are bit rows as in :mod:`simplifier.kernels.coverage`, (V, rows, words) uint64.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one, popcount
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.faces import (
    columns_of_row,
    columns_of_word,
    lies_between,
    project,
    rows_of,
)
from simplifier.kernels.random_quads import bit
from simplifier.kernels.threads import run_chunks

_MANY = 1 << 20  # columns: more than there are
_LOOKS = 8  # at rows, for each row: they take half as long as the distances of all pixels
_ASIDE = 32  # columns: nearly all that lies beside is nearer than that


@inline_kernel
def _around(mask, row, word):
    """The pixels of a word and of those above and below it."""
    united = mask[row, word]
    if row > 0:
        united |= mask[row - 1, word]
    if row + 1 < mask.shape[0]:
        united |= mask[row + 1, word]
    return united


@inline_kernel
def _near(mask, row, word):
    """The pixels within one of the mask, even across a corner, of a word."""
    one, last = np.uint64(1), np.uint64(63)
    here = _around(mask, row, word)
    near = here | (here << one) | (here >> one)
    if word > 0:
        near |= _around(mask, row, word - 1) >> last
    if word + 1 < mask.shape[1]:
        near |= _around(mask, row, word + 1) << last
    return near


@inline_kernel
def _count_view(original, shown, over):
    """(pixels of the original, pixels of ``shown`` beside it), the latter filled into ``over``."""
    there, beside = np.uint64(0), np.uint64(0)
    for row in range(original.shape[0]):
        for word in range(original.shape[1]):
            there += popcount(original[row, word])
            over[row, word] = shown[row, word] & ~original[row, word]
            if over[row, word] != 0:
                over[row, word] &= ~_near(original, row, word)
                beside += popcount(over[row, word])
    return np.int64(there), np.int64(beside)


@kernel("uint64[:, :, :], int64, int64, uint64[:, :, :], int64[:]")
def widen(masks, begin, end, wide, pixels):
    """Fill views ``begin`` to ``end``.

    ``wide``    (V, rows, words) uint64: pixels within one of the mask, even across a corner.
    ``pixels``  (V,) int64: how many the mask has.
    """
    for view in range(begin, end):
        there = np.uint64(0)
        for row in range(masks.shape[1]):
            for word in range(masks.shape[2]):
                wide[view, row, word] = _near(masks[view], row, word)
                there += popcount(masks[view, row, word])
        pixels[view] = np.int64(there)


@kernel("uint64[:, :, :], uint64[:, :, :], int64, int64, int64[:]")
def count_beside(wide, hidden, begin, end, beside):
    """Fill views ``begin`` to ``end`` of ``beside`` (V,) int64.

    These are the pixels of ``hidden`` that are not in ``wide``, both (V, rows, words) uint64.
    """
    for view in range(begin, end):
        count = np.uint64(0)
        for row in range(wide.shape[1]):
            for word in range(wide.shape[2]):
                count += popcount(hidden[view, row, word] & ~wide[view, row, word])
        beside[view] = np.int64(count)


@inner_kernel
def _count_span(wide, row, first, end):
    """How many of the columns from ``first`` to before ``end`` are not in ``wide``."""
    beside = np.uint64(0)
    for word in range(first >> 6, ((end - 1) >> 6) + 1):
        beside += popcount(columns_of_word(first, end, word) & ~wide[row, word])
    return np.int64(beside)


@kernel(
    "float64[:, :, :], float64[:, :, :], uint64[:, :, :], float64[:], int64, int64, float64[:, :]"
)
def weigh_each(triangles, projections, wide, weights, begin, end, found):
    """Fill rows ``begin`` to ``end`` of ``found`` (m, 2): what each of ``triangles`` covers by
    itself, beside ``wide`` and within it, pixels times the ``weights`` (V,) of their views.

    ``triangles``    (m, 3, 3) float64, a row for the x of the corners, for their y, for their z.
    ``projections``  (V, 2, 4) float64 to the pixels of ``wide`` (V, rows, words).
    """
    points, cells = np.empty((3, 2)), np.empty(3, np.uint32)
    rows, columns = wide.shape[1], 64 * wide.shape[2]
    for one in range(begin, end):
        found[one, 0] = found[one, 1] = 0.0
        for view in range(len(projections)):
            project(triangles[one], projections[view], rows, columns, points, cells)
            if lies_between(cells[0], cells[1], cells[2]):
                continue
            bottom, bend, top, low, middle, high = rows_of(cells[0], cells[1], cells[2], 0, 1, 2)
            beside, covered = 0, 0
            for row in range(bottom, top):
                first, past = columns_of_row(points, bend, low, middle, high, row, columns)
                if first < past:
                    covered += past - first
                    beside += _count_span(wide[view], row, first, past)
            found[one, 0] += weights[view] * beside
            found[one, 1] += weights[view] * (covered - beside)


def shares_beside(there: NDArray[np.int64], beside: NDArray[np.int64]) -> NDArray[np.float64]:
    """(V,) float64: what lies beside as a share of the original's pixels, both (V,).

    Where the original shows nothing 1 if anything lies there, else 0.
    """
    shares = np.where(there > 0, beside / np.maximum(there, 1), beside > 0)
    return np.asarray(shares, dtype=np.float64)


def overhang_pixels(
    original: NDArray[np.uint64], hidden: NDArray[np.uint64], columns: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(V, 2) int64 pixels of the original and of ``hidden`` beside it, (V,) int64 how far out.

    ``original``, ``hidden``  (V, rows, words) bit rows of ``columns`` pixels; the results are as
    :func:`count_overhang` says.
    """
    pixels = np.empty((len(original), 2), dtype=np.int64)
    farthest = np.empty(len(original), dtype=np.int64)
    run_chunks(
        lambda begin, end: count_overhang(original, hidden, columns, begin, end, pixels, farthest),
        len(original),
    )
    return pixels, farthest


@inner_kernel
def _fill_heights(mask, heights):
    """Fill ``heights`` (rows, columns) int32: pixels up or down to the nearest one of the mask."""
    rows, columns = heights.shape
    far = rows + columns
    for row in range(rows):
        for column in range(columns):
            if bit(mask, row, column) != 0:
                heights[row, column] = 0
            else:
                heights[row, column] = heights[row - 1, column] + 1 if row > 0 else far
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            heights[row, column] = min(heights[row, column], heights[row + 1, column] + 1)


@inline_kernel
def _overtakes(heights, row, left, right):
    """The last column that is no further from the pixel below ``left`` than from ``right``'s."""
    there, here = np.int64(heights[row, right]), np.int64(heights[row, left])
    return (right * right - left * left + there * there - here * here) // (2 * (right - left))


@inner_kernel
def _fill_distances(heights, row, columns, ends, distances):
    """Fill ``distances`` (columns,) int64, squared, of a row's pixels to the nearest of the mask.

    The lower envelope of a parabola a column (Meijster, Roerdink, Hesselink 2000): ``columns``
    (columns,) int64 is whose parabola is lowest up to ``ends`` (columns,) int64.
    """
    width = heights.shape[1]
    top = 0
    columns[0] = 0
    for column in range(1, width):
        end = _overtakes(heights, row, columns[top], column)
        while top > 0 and end <= ends[top - 1]:
            top -= 1
            end = _overtakes(heights, row, columns[top], column)
        if end < 0:
            columns[0] = column
        elif end < width - 1:
            ends[top] = end
            top += 1
            columns[top] = column
    ends[top] = width
    lowest = 0
    for column in range(width):
        if column > ends[lowest]:
            lowest += 1
        aside, height = column - columns[lowest], np.int64(heights[row, columns[lowest]])
        distances[column] = aside * aside + height * height


@inline_kernel
def _look_aside(heights, row, column, most):
    """The squared distance of a pixel to the nearest of the mask, or -1 where that is not found
    among the columns nearby; if it is no more than ``most``, anything that is not."""
    width = heights.shape[1]
    nearest = np.int64(heights[row, column]) ** 2
    for aside in range(1, _ASIDE + 1):
        if nearest <= most or aside * aside >= nearest:
            return nearest
        left, right = (
            np.int64(heights[row, max(column - aside, 0)]),
            np.int64(heights[row, min(column + aside, width - 1)]),
        )
        nearest = min(nearest, aside * aside + min(left, right) ** 2)
    return np.int64(-1)


@inner_kernel
def _farthest_of_row(heights, over, row, most, columns, ends, distances):
    """The largest squared distance of a row's pixels of ``over``, if it is more than ``most``."""
    whole = False
    for word in range(over.shape[1]):
        waiting = over[row, word]
        while waiting != 0:
            lowest, place = lowest_one(waiting)
            waiting ^= lowest
            column = 64 * word + place
            if not whole:
                found = _look_aside(heights, row, column, most)
                whole = found < 0
                if whole:
                    _fill_distances(heights, row, columns, ends, distances)
            most = max(most, distances[column] if whole else found)
    return most


@inline_kernel
def _columns_aside(line, column):
    """Columns to the nearest pixel of a row of the mask, from one that is not of it; many if there
    is none."""
    word, place = column >> 6, np.uint64(column & 63)
    ahead, behind = line[word] >> place, line[word] << (np.uint64(63) - place)
    nearest = np.int64(_MANY)
    further = np.int64(0)
    while ahead == 0 and word + further + 1 < len(line):
        further += 1
        ahead = line[word + further]
    if ahead != 0:
        first = 64 * further - (np.int64(place) if further > 0 else 0)
        nearest = first + lowest_one(ahead)[1]
    further = np.int64(0)
    while behind == 0 and word - further > 0:
        further += 1
        behind = line[word - further]
    if behind != 0:
        last = 64 * further - (63 - np.int64(place) if further > 0 else 0)
        for shift in (1, 2, 4, 8, 16, 32):
            behind |= behind >> np.uint64(shift)
        nearest = min(nearest, last + 64 - np.int64(popcount(behind)))
    return nearest


@inner_kernel
def _farthest_by_rows(mask, over, row, most, looks):
    """(as :func:`_farthest_of_row`, what is left of ``looks`` at rows: below 0 it was broken off).

    Most of what lies beside is few pixels, near the mask: the rows next to theirs tell how near.
    """
    for word in range(over.shape[1]):
        waiting = over[row, word]
        while waiting != 0:
            lowest, place = lowest_one(waiting)
            waiting ^= lowest
            nearest, away = np.int64(_MANY) ** 2, 0
            while nearest > most and away * away < nearest and away < len(mask):
                for other in (row - away, row + away):
                    if 0 <= other < len(mask):
                        aside = _columns_aside(mask[other], 64 * word + place)
                        nearest = min(nearest, away * away + aside * aside)
                away += 1
            looks -= away
            if looks < 0:
                return most, looks
            most = max(most, nearest)
    return most, looks


@kernel("uint64[:, :, :], uint64[:, :, :], int64, int64, int64, int64[:, :], int64[:]")
def count_overhang(originals, hidden, width, begin, end, pixels, farthest):
    """Fill views ``begin`` to ``end`` of ``width`` columns.

    ``pixels``    (V, 2) int64: those of the original, and those of ``hidden`` that are more than
                  one pixel away from it, even across a corner.
    ``farthest``  (V,) int64: the largest squared distance of such a pixel from the original, pixels
                  from centre to centre; 0 where there is none, -1 where the original shows nothing.
    """
    rows, words = originals.shape[1:]
    heights = np.empty((rows, width), np.int32)
    over = np.empty((rows, words), np.uint64)
    columns = np.empty(width, np.int64)
    ends = np.empty(width, np.int64)
    distances = np.empty(width, np.int64)
    for view in range(begin, end):
        original, shown = originals[view], hidden[view]
        there, beside = _count_view(original, shown, over)
        most = np.int64(0)
        if beside > 0 and there == 0:
            most = np.int64(-1)
        elif beside > 0:
            looks = np.int64(_LOOKS * rows)
            filled = False
            for row in range(rows):
                if looks >= 0:
                    most, looks = _farthest_by_rows(original, over, row, most, looks)
                if looks < 0:
                    if not filled:
                        _fill_heights(original, heights)
                        filled = True
                    most = _farthest_of_row(heights, over, row, most, columns, ends, distances)
        pixels[view, 0], pixels[view, 1] = there, beside
        farthest[view] = most
