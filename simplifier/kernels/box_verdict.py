"""Is a box hidden by what a depth buffer holds?

A box is judged by its screen rectangle at the depth of its nearest corner, both on the safe side,
and where that does not settle it by its own outline and front (:mod:`box_outline`), which find a
third more hidden boxes indoors; by the outline alone it would be nearly none.  Both grow by a
margin for what the occluders' outlines may be off: the largest screen error of the tiles that the
rectangle meets, which is asked again of the larger rectangle until it settles.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.box_outline import EDGES, PLANES, is_outline_hidden
from simplifier.kernels.coarse_depth import is_block_nearer, largest_blur
from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.perspective import COLUMNS, NEAR, ROWS, projected

VISIBLE, HIDDEN, OUTSIDE = 0, 1, 2

_SLACK = 1e-6  # pixels, for rounding
_ROUNDS = 8  # of the margin; a box that has not settled by then counts as visible
_UP = 1.0 + 2.0**-22  # before rounding to float32: the result is not below


@kernel
def judge_boxes(boxes, view, depth, tiles, margin, verdicts):
    """Fill ``verdicts`` (n,) uint8 for ``boxes`` (n, 2, 3) float64, lowest and highest corners.

    ``view``    (16,) float64, :mod:`perspective`.
    ``depth``   (8 r, 8 c) float32, ``tiles`` (3, r, c) float32: :mod:`depth_buffer`; stale tiles
                that decide are made fresh.
    ``margin``  pixels, 0 or more: the least that rectangles grow by.
    """
    corners, edges, planes = np.empty((8, 2)), np.empty((EDGES, 4)), np.empty((PLANES, 3))
    for index in range(len(boxes)):
        verdicts[index] = box_verdict(
            boxes, index, view, depth, tiles, margin, corners, edges, planes
        )


@kernel
def box_verdict(boxes, index, view, depth, tiles, margin, corners, edges, planes):
    """VISIBLE, HIDDEN or OUTSIDE for one of ``boxes``; what is not a number is visible.

    ``corners`` (8, 2), ``edges`` (12, 4), ``planes`` (3, 3) float64: room to work in.
    """
    verdict, left, right, top, bottom, nearest = screen_rectangle(boxes, index, view)
    if verdict != HIDDEN:
        return verdict
    value = np.float32(_UP / nearest)
    rows, columns = np.int64(view[ROWS]), np.int64(view[COLUMNS])
    grown = margin
    for _ in range(_ROUNDS):
        reach = grown + _SLACK
        first_row, last_row = _pixel(top - reach, rows), _pixel(bottom + reach, rows)
        first, last = _pixel(left - reach, columns), _pixel(right + reach, columns)
        needed = margin + largest_blur(tiles, first_row, last_row, first, last)
        if needed <= grown:
            if is_block_nearer(depth, tiles, value, first_row, last_row, first, last):
                return HIDDEN
            if is_outline_hidden(boxes, index, view, depth, reach, corners, edges, planes):
                return HIDDEN
            return VISIBLE
        grown = needed
    return VISIBLE


@kernel
def screen_rectangle(boxes, index, view):
    """(verdict, left, right, top, bottom, nearest): bounds in pixels, and the least depth.

    The verdict is OUTSIDE when all corners lie behind one plane of the view frustum, VISIBLE when
    the box reaches before the near plane, and HIDDEN, which is to be proved, otherwise.
    """
    rows, columns, near = view[ROWS], view[COLUMNS], view[NEAR]
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    nearest, farthest = np.inf, -np.inf
    most_x, most_y, least_x, least_y = -np.inf, -np.inf, -np.inf, -np.inf
    doubt = 0.0  # NaN as soon as something is not finite
    for corner in range(8):
        x, y, z = projected(
            view, boxes[index, corner & 1, 0], boxes[index, (corner >> 1) & 1, 1],
            boxes[index, corner >> 2, 2],
        )  # fmt: skip
        doubt += 0.0 * (x + y + z)
        scale = 1.0 / z
        left, right = min(left, x * scale), max(right, x * scale)
        top, bottom = min(top, y * scale), max(bottom, y * scale)
        nearest, farthest = min(nearest, z), max(farthest, z)
        most_x, most_y = max(most_x, x), max(most_y, y)
        least_x, least_y = max(least_x, columns * z - x), max(least_y, rows * z - y)
    verdict = HIDDEN
    if doubt != 0.0:
        verdict = VISIBLE
    elif farthest < near or min(most_x, most_y, least_x, least_y) < 0.0:
        verdict = OUTSIDE
    elif nearest < near:
        verdict = VISIBLE
    return verdict, left, right, top, bottom, nearest


@inline_kernel
def _pixel(place, count):
    """The pixel of 0..count - 1 that holds a place, or the one at that end of the screen."""
    return np.int64(min(max(place, 0.0), float(count - 1)))


@kernel
def mark_outside(boxes, view, outside):
    """Fill ``outside`` (n,) bool: which of ``boxes`` lie behind a plane of the view frustum."""
    for index in range(len(boxes)):
        outside[index] = screen_rectangle(boxes, index, view)[0] == OUTSIDE
