"""Pixels that an occluder covers beside the original: how many, and how far out.

Masks are bit rows as in :mod:`simplifier.kernels.coverage`, (V, rows, words) uint64.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel


@inline_kernel
def _count_ones(word):
    """Bits that are set in a word of 64, by halves."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + (
        (word >> np.uint64(2)) & np.uint64(0x3333333333333333)
    )
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


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


@kernel
def _fill_heights(mask, heights):
    """Fill ``heights`` (rows, columns) int64: pixels up or down to the nearest one of the mask."""
    rows, columns = heights.shape
    far = np.int64(rows + columns)
    for row in range(rows):
        for column in range(columns):
            if (mask[row, column >> 6] >> np.uint64(column & 63)) & np.uint64(1):
                heights[row, column] = 0
            else:
                heights[row, column] = heights[row - 1, column] + 1 if row > 0 else far
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            heights[row, column] = min(heights[row, column], heights[row + 1, column] + 1)


@kernel
def _squared_distance(heights, row, column, least):
    """From a pixel's centre to that of the nearest pixel of the mask, if that is above ``least``.

    Else what is no more than ``least``.
    """
    columns = heights.shape[1]
    best = heights[row, column] ** 2
    aside = 1
    while best > least and aside * aside < best:
        if column >= aside:
            best = min(best, aside * aside + heights[row, column - aside] ** 2)
        if column + aside < columns:
            best = min(best, aside * aside + heights[row, column + aside] ** 2)
        aside += 1
    return best


@kernel
def count_overhang(originals, hidden, columns, begin, end, pixels, farthest):
    """Fill views ``begin`` to ``end``.

    ``pixels``    (V, 2) int64: those of the original, and those of ``hidden`` that are more than
                  one pixel away from it, even across a corner.
    ``farthest``  (V,) int64: the largest squared distance of such a pixel from the original, pixels
                  from centre to centre; 0 where there is none, -1 where the original shows nothing.
    """
    heights = np.empty((originals.shape[1], columns), np.int64)
    for view in range(begin, end):
        original, shown = originals[view], hidden[view]
        there, beside, most = np.int64(0), np.int64(0), np.int64(0)
        for row in range(original.shape[0]):
            for word in range(original.shape[1]):
                there += _count_ones(original[row, word])
                beside += _count_ones(shown[row, word] & ~_near(original, row, word))
        if beside > 0 and there == 0:
            most = np.int64(-1)
        elif beside > 0:
            _fill_heights(original, heights)
            for row in range(original.shape[0]):
                for word in range(original.shape[1]):
                    over = shown[row, word] & ~_near(original, row, word)
                    for bit in range(64):
                        if (over >> np.uint64(bit)) & np.uint64(1):
                            found = _squared_distance(heights, row, 64 * word + bit, most)
                            most = max(most, found)
        pixels[view, 0], pixels[view, 1] = there, beside
        farthest[view] = most
