"""Random quads inside two masks: the sampled form of precision and recall (paper section 6.1)."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@inline_kernel
def _mixed(state):
    """The output step of splitmix64 (Steele, Lea, Flood 2014): a bijection with good avalanche."""
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state ^ (state >> np.uint64(31))


@inline_kernel
def _scaled(bits, limit):
    """32 random bits to 0 .. limit - 1; the bias is below limit / 2^32."""
    return np.int64((bits * np.uint64(limit)) >> np.uint64(32))


@inline_kernel
def bit(mask, row, column):
    """1 where the pixel is covered, else 0 (uint64)."""
    return (mask[row, column >> 6] >> np.uint64(column & 63)) & np.uint64(1)


@kernel
def bounding_box(mask, columns):
    """(first row, row end, first column, column end) of the covered pixels; all 0 when none is."""
    rows, words = mask.shape
    union = np.zeros(words, np.uint64)
    first_row = rows
    row_end = 0
    for row in range(rows):
        for word in range(words):
            if mask[row, word] != 0:
                first_row = min(first_row, row)
                row_end = row + 1
                union[word] |= mask[row, word]
    if row_end == 0:
        return 0, 0, 0, 0
    first_column = columns
    column_end = 0
    for column in range(columns):
        if (union[column >> 6] >> np.uint64(column & 63)) & np.uint64(1) != 0:
            first_column = min(first_column, column)
            column_end = column + 1
    return first_row, row_end, first_column, column_end


@kernel
def _sum_table(original, occluder, box, table):
    """Summed-area tables of both masks over the box, in one word a place.

    ``table`` (> height, > width) uint64: original in the lower 32 bits, occluder in the upper.
    Differences of sums come out right in both halves, because the true counts are not negative and
    fit in 32 bits.
    """
    first_row, row_end, first_column, column_end = box
    for x in range(column_end - first_column + 1):
        table[0, x] = 0
    for row in range(first_row, row_end):
        y = row - first_row
        running = np.uint64(0)
        table[y + 1, 0] = 0
        for column in range(first_column, column_end):
            both = bit(original, row, column) | (bit(occluder, row, column) << np.uint64(32))
            running += both
            x = column - first_column + 1
            table[y + 1, x] = table[y, x] + running


@kernel
def sample_quads(originals, occluders, columns, quads, seed, first_view, begin, end, pixels):
    """Fill ``pixels[begin:end]`` with the pixel sums (Nt, Pf, Nf) of ``quads`` random quads.

    ``originals``, ``occluders``  (V, rows, words) uint64.
    ``seed``, ``first_view``      uint64; view v of the arrays draws the numbers of view
                                  first_view + v: they depend on (seed, view, quad) alone.
    ``pixels``                    (V, 3) int64.
    """
    rows = originals.shape[1]
    table = np.empty((rows + 1, columns + 1), np.uint64)
    low_half = np.uint64(0xFFFFFFFF)
    for view in range(begin, end):
        box = bounding_box(originals[view], columns)
        height = box[1] - box[0]
        width = box[3] - box[2]
        true_positive = 0
        missed = 0
        wrong = 0
        if height > 0:
            _sum_table(originals[view], occluders[view], box, table)
            state = _mixed(_mixed(seed + _GOLDEN) + (first_view + np.uint64(view)) * _GOLDEN)
            for _ in range(quads):
                state += _GOLDEN
                across = _mixed(state)
                state += _GOLDEN
                along = _mixed(state)
                x0 = _scaled(across & low_half, width)
                x1 = _scaled(across >> np.uint64(32), width)
                y0 = _scaled(along & low_half, height)
                y1 = _scaled(along >> np.uint64(32), height)
                left = min(x0, x1)
                right = max(x0, x1) + 1
                low = min(y0, y1)
                high = max(y0, y1) + 1
                count = (
                    table[high, right] - table[low, right] - table[high, left] + table[low, left]
                )
                area = (right - left) * (high - low)
                in_original = np.int64(count & low_half)
                in_occluder = np.int64(count >> np.uint64(32))
                if in_original == area:
                    if in_occluder == area:
                        true_positive += area
                    else:
                        missed += area
                elif in_occluder == area:
                    wrong += area - in_original
        pixels[view, 0] = true_positive
        pixels[view, 1] = missed
        pixels[view, 2] = wrong
