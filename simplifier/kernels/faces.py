"""Triangles of one view, into its bit image of 64 pixels a word.

Which pixels a triangle covers is said in :mod:`simplifier.kernels.coverage`.  Most triangles of a
fine mesh lie between pixel centres; of the others most hold only pixels that are covered already,
since soups are layered.  Both are sorted out 16 at a time.  Of what is left, small triangles are
drawn eight at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.intrinsic import intrinsic
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel

_MANY_ROWS = 16
"""Of a triangle whose crossings are computed for several rows at once; behind others, too."""

_ROOM = 96
"""Triangles in a list: 15 that wait for others, 64 more, and 16 that are written behind them."""


@inner_kernel
def project(vertices, projection, rows, columns, points, cells):
    """Fill ``points`` (n, 2) with image coordinates whose whole numbers are pixel centres, and
    ``cells`` (n,) with the cell of each vertex.

    A cell is (first row at or above y, first column at or right of x), clamped to the image, the
    row in the upper 16 bits: all that is needed to drop a triangle between pixel centres.
    """
    a, b, c, d = projection[0]
    e, f, g, h = projection[1]
    d -= 0.5
    h -= 0.5
    for i in range(len(cells)):
        x = a * vertices[0, i] + b * vertices[1, i] + c * vertices[2, i] + d
        y = e * vertices[0, i] + f * vertices[1, i] + g * vertices[2, i] + h
        points[i, 0] = x
        points[i, 1] = y
        column = np.uint32(np.int32(np.ceil(min(max(x, 0.0), float(columns)))))
        row = np.uint32(np.int32(np.ceil(min(max(y, 0.0), float(rows)))))
        cells[i] = (row << np.uint32(16)) | column


@inline_kernel
def crossing(points, low, high, row):
    """x where the edge low -> high meets the row; low's row cell is below high's."""
    return _crossing(points[low, 0], points[low, 1], points[high, 0], points[high, 1], row)


@inline_kernel
def _crossing(low_x, low_y, high_x, high_y, row):
    return low_x + (row - low_y) / (high_y - low_y) * (high_x - low_x)


@inline_kernel
def run_of_ones(first, count):
    """``count`` (1..64) ones from bit ``first`` on, within one word."""
    return (~np.uint64(0) >> np.uint64(64 - count)) << np.uint64(first)


@inline_kernel
def columns_of_word(begin, end, word):
    """The bits of a word of a row that are columns from ``begin`` to before ``end``."""
    first, last = max(begin - 64 * word, 0), min(end - 64 * word, 64)
    return run_of_ones(first, last - first) if first < last else np.uint64(0)


@inline_kernel
def lies_between(p, q, r):
    """Whether no pixel centre is in the box of a triangle: the fate of most of a fine mesh.

    ``p``, ``q``, ``r`` are the cells of its vertices.
    """
    differ = (p ^ q) | (p ^ r)
    return (differ & np.uint32(0xFFFF)) == 0 or (differ >> np.uint32(16)) == 0


@inline_kernel
def box_columns(p, q, r):
    """(word, bits) of the columns of that box if one word holds them; else no bits."""
    low_half = np.uint32(0xFFFF)
    left = np.int64(min(p & low_half, q & low_half, r & low_half))
    right = np.int64(max(p & low_half, q & low_half, r & low_half)) - 1
    word = left >> 6
    bits = np.uint64(0)
    if word == right >> 6:
        bits = run_of_ones(left & 63, right - left + 1)
    return word, bits


@inline_kernel
def rows_of(p, q, r, i, j, k):
    """(first row, row of the bend, row end, and the vertices in that order) of a triangle.

    ``p``, ``q``, ``r`` are the cells of its vertices ``i``, ``j``, ``k``.  Sorted without branches;
    equal rows may come in any order, their edge is not used.
    """
    a = (np.uint64(p) << np.uint64(32)) | np.uint64(i)
    b = (np.uint64(q) << np.uint64(32)) | np.uint64(j)
    c = (np.uint64(r) << np.uint64(32)) | np.uint64(k)
    low = min(a, b, c)
    high = max(a, b, c)
    middle = a ^ b ^ c ^ low ^ high
    row, vertex = np.uint64(48), np.uint64(0xFFFFFFFF)
    return (
        np.int64(low >> row), np.int64(middle >> row), np.int64(high >> row),
        np.int64(low & vertex), np.int64(middle & vertex), np.int64(high & vertex),
    )  # fmt: skip


def _write_list_pictured(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.boxes import write_list_pictured  # with llvmlite

    return write_list_pictured(builder, _ROOM, *given)


@intrinsic(_write_list_pictured)
def list_pictured(cells, faces, begin, listed, count):
    """List those of the 64 faces from ``begin`` on that do not lie between pixels behind ``count``
    others; return how many there are now, a uint64.

    ``listed``  (6, _ROOM) int32: the vertices of a face's corners, then their cells.  What is not
                listed of the 16 places behind the last one is undefined.
    """
    for i, j, k in faces[begin : begin + 64]:
        p, q, r = cells[i], cells[j], cells[k]
        if not lies_between(p, q, r):
            listed[:, count] = np.array([i, j, k, p, q, r], np.uint32).view(np.int32)
            count += 1
    return np.uint64(count)


def _write_list_bare(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.boxes import write_list_bare

    return write_list_bare(builder, _ROOM, *given)


@intrinsic(_write_list_bare)
def list_bare(listed, begin, mask, words, most_rows, bare, count):
    """List those of the 16 faces from ``begin`` on that are small, and whose box has a pixel that
    ``mask`` has not, behind ``count`` others in ``bare``.

    Small is what has no more than ``most_rows`` rows and lies in a :func:`_window`; ``words`` are
    in a row.  Returns, as a uint64, how many are listed now, and from bit 32 on a bit a face: the
    large ones.  Lists as in :func:`list_pictured`.
    """
    large = 0
    for place in range(16):
        face = listed[:, begin + place]
        rows, columns = face[3:].view(np.uint32) >> 16, face[3:] & 0xFFFF
        window = _window(columns.min(), words)
        if rows.max() - rows.min() > most_rows or columns.max() - window > 64:
            large |= 1 << place
            continue
        box = _bits_of(columns.min(), columns.max(), window)
        if any(_bits_at(mask, row, window) & box != box for row in range(rows.min(), rows.max())):
            bare[:, count] = face
            count += 1
    return np.uint64(int(count) | large << 32)


def _write_draw_eight(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.small_faces import write_draw_eight

    return write_draw_eight(builder, _ROOM, *given)


@intrinsic(_write_draw_eight)
def draw_eight(points, listed, begin, columns, mask, words):
    """Draw the eight faces from ``begin`` on, which are small, as :func:`list_bare` lists them.

    Returns, as a uint64, a bit a face: those that rounding takes out of their :func:`_window`,
    where it leaves pixels out.
    """
    beyond = 0
    for place in range(8):
        i, j, k, p, q, r = listed[:, begin + place].view(np.uint32)
        bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
        window = _window(min(p & 0xFFFF, q & 0xFFFF, r & 0xFFFF), words)
        for row in range(bottom, top):
            first, end = columns_of_row(points, bend, low, middle, high, row, columns)
            if first < end and window <= first and end <= window + 64:
                _add_bits(mask, row, window, _bits_of(first, end, window))
            elif first < end:
                beyond |= 1 << place
    return np.uint64(beyond)


def _window(left, words):
    """The first of 64 columns, a multiple of 32, among which the column ``left`` and the 32 behind
    it are, if they are on the image."""
    return min(int(left) & ~31, 64 * (int(words) - 1))


def _bits_of(first, end, window):
    return ((1 << int(end - first)) - 1) << int(first - window)


def _bits_at(mask, row, window):
    return int.from_bytes(mask[row].tobytes()[window // 8 : window // 8 + 8], "little")


def _add_bits(mask, row, window, bits):
    octets = mask[row].view(np.uint8)[window // 8 : window // 8 + 8]
    octets |= np.frombuffer(bits.to_bytes(8, "little"), np.uint8)


@inner_kernel
def draw_faces(points, cells, faces, columns, mask):
    """Set the covered bits of one view, whose vertices :func:`project` has projected."""
    spans, words = empty_spans(mask), mask.shape[1]
    pictured, bare = np.empty((6, _ROOM), np.int32), np.empty((6, _ROOM), np.int32)
    waiting, few = np.uint64(0), np.uint64(0)
    whole = len(faces) & ~63
    for begin in range(0, whole, 64):
        waiting = list_pictured(cells, faces, begin, pictured, waiting)
        while waiting >= 16:
            waiting -= np.uint64(16)
            found = list_bare(pictured, waiting, mask, words, _MANY_ROWS, bare, few)
            few, large = found & np.uint64(0xFFFFFFFF), found >> np.uint64(32)
            _draw_listed(points, cells, pictured, waiting, large, columns, mask, spans)
            while few >= 8:
                few -= np.uint64(8)
                beyond = draw_eight(points, bare, few, columns, mask, words)
                _draw_listed(points, cells, bare, few, beyond, columns, mask, spans)
    all_bits = ~np.uint64(0)
    _draw_listed(
        points, cells, pictured, np.uint64(0), ~(all_bits << waiting), columns, mask, spans
    )
    _draw_listed(points, cells, bare, np.uint64(0), ~(all_bits << few), columns, mask, spans)
    for face in range(whole, len(faces)):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        if not lies_between(cells[i], cells[j], cells[k]):
            draw_face(points, cells, i, j, k, columns, mask, spans)


@inner_kernel
def _draw_listed(points, cells, listed, begin, bits, columns, mask, spans):
    """Draw the faces that have a bit of those from ``begin`` on, one by one."""
    while bits != 0:
        lowest, place = lowest_one(bits)
        bits ^= lowest
        at = begin + np.uint64(place)
        i, j, k = listed[0, at], listed[1, at], listed[2, at]
        draw_face(points, cells, i, j, k, columns, mask, spans)


@inline_kernel
def empty_spans(mask):
    """Scratch for :func:`draw_face`: (2, rows)."""
    return np.empty((2, mask.shape[0]), np.int64)


@inline_kernel
def draw_face(points, cells, i, j, k, columns, mask, spans):
    """Draw the triangle of vertices ``i``, ``j`` and ``k``, which does not lie between pixels."""
    p, q, r = cells[i], cells[j], cells[k]
    bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
    if top - bottom >= _MANY_ROWS:
        _fill_spans(points, (low, high), (low, middle), bottom, bend, columns, spans)
        _fill_spans(points, (low, high), (middle, high), bend, top, columns, spans)
        for row in range(bottom, top):
            if spans[0, row] < spans[1, row]:
                set_span(mask, row, spans[0, row], spans[1, row] - 1)
        return
    box_word, box = box_columns(p, q, r)
    for row in range(bottom, top):
        # Behind other triangles: nothing to add.  Halves the work, soups are layered.
        if box != 0 and (mask[row, box_word] & box) == box:
            continue
        first, end = columns_of_row(points, bend, low, middle, high, row, columns)
        if first < end:
            set_span(mask, row, first, end - 1)


@inline_kernel
def columns_of_row(points, bend, low, middle, high, row, columns):
    """The first column of a triangle in a row, and the one after the last; :func:`rows_of` tells
    the row of its bend, and its vertices from the lowest to the highest."""
    x0 = crossing(points, low, high, row)
    if row < bend:
        x1 = crossing(points, low, middle, row)
    else:
        x1 = crossing(points, middle, high, row)
    return _columns_between(x0, x1, columns)


@inline_kernel
def _columns_between(x0, x1, columns):
    """The first column between two crossings, and the one after the last."""
    return (
        np.int64(np.ceil(min(max(min(x0, x1), 0.0), float(columns)))),
        np.int64(np.ceil(min(max(max(x0, x1), 0.0), float(columns)))),
    )


@inline_kernel
def _fill_spans(points, one, other, begin, end, columns, spans):
    """Fill ``spans`` (2, rows) with the columns between two edges, (low, high) each, of the rows
    ``begin`` to ``end``: a loop that divides for several rows at once."""
    ax, ay, bx, by = _ends_of(points, one)
    cx, cy, dx, dy = _ends_of(points, other)
    for row in range(begin, end):
        first, last = _columns_between(
            _crossing(ax, ay, bx, by, row), _crossing(cx, cy, dx, dy, row), columns
        )
        spans[0, np.uint64(row)] = first
        spans[1, np.uint64(row)] = last


@inline_kernel
def _ends_of(points, edge):
    low, high = edge
    return points[low, 0], points[low, 1], points[high, 0], points[high, 1]


@inline_kernel
def set_span(mask, row, first, last):
    word = first >> 6
    last_word = last >> 6
    if word == last_word:
        mask[row, word] |= run_of_ones(first & 63, last - first + 1)
    else:
        mask[row, word] |= ~np.uint64(0) << np.uint64(first & 63)
        for between in range(word + 1, last_word):
            mask[row, between] = ~np.uint64(0)
        mask[row, last_word] |= ~np.uint64(0) >> np.uint64(63 - (last & 63))
