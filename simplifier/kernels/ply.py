"""Follow rows whose lengths are known only from the rows before."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel

TRUNCATED = -1
NEGATIVE = -2


@kernel("uint8[:], int64, bool[:], int64[:], int64[:], bool[:], bool, int64[:, :]")
def walk_rows(cells, start, counted, sizes, items, signed, big_endian, places):
    """Fill ``places`` (rows, columns) int64 with where each column of each row begins.

    ``cells``    (n,) uint8; int64 for :func:`walk_text_rows`, where every value takes one cell.
    ``counted``  (columns,) bool: the column is a list, its length followed by its items.
    ``sizes``    (columns,) int64: cells of the value, or of the list's length; at most 8.
    ``items``    (columns,) int64: cells of one item of the list.
    ``signed``   (columns,) bool: the list's length is in two's complement.

    Returns (where the last row ends, 0), or (:data:`TRUNCATED` or :data:`NEGATIVE`, the row at
    fault).  No sum leaves 64 bits: a length is compared with what is left before it is added.
    """
    return _walk_rows(cells, start, counted, sizes, items, signed, big_endian, places)


@kernel("int64[:], int64, bool[:], int64[:], int64[:], bool[:], bool, int64[:, :]")
def walk_text_rows(cells, start, counted, sizes, items, signed, big_endian, places):
    """:func:`walk_rows` over the words of a text."""
    return _walk_rows(cells, start, counted, sizes, items, signed, big_endian, places)


@inner_kernel
def _walk_rows(cells, start, counted, sizes, items, signed, big_endian, places):
    position = start
    length = cells.size
    rows, columns = places.shape
    for row in range(rows):
        for column in range(columns):
            places[row, column] = position
            size = sizes[column]
            if size > length - position:
                return TRUNCATED, row
            if counted[column]:
                count = np.int64(0)
                for k in range(size):
                    at = k if big_endian else size - 1 - k
                    count = count * 256 + np.int64(cells[position + at])
                if signed[column] and size < 8 and count >= np.int64(1) << (8 * size - 1):
                    count -= np.int64(1) << (8 * size)
                if count < 0:
                    return NEGATIVE, row
                if count > (length - position - size) // items[column]:
                    return TRUNCATED, row
                position += count * items[column]
            position += size
    return position, 0
