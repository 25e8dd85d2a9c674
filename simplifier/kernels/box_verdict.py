"""Is a box hidden by what a depth buffer holds?

A box is judged by its screen rectangle at the depth of its nearest corner, both on the safe side,
and where that does not settle it by its own outline and front, which find a
third more hidden boxes indoors; by the outline alone it would be nearly none.  Both grow by a
margin for what the occluders' outlines may be off: the largest screen error of the tiles that the
rectangle meets, which is asked again of the larger rectangle until it settles.

Is a box hidden by a depth buffer, judged by its own outline and its own front?

Exacter than the screen rectangle at the depth of its nearest corner, and dearer.  A row of pixels
is tested where it meets the convex outline of the corners, and a pixel at the depth where its line
of sight enters the box: a plane's reciprocal depth is linear over the screen, and the line is in
the box only from behind all planes that face the camera, so the least of theirs is where it enters.

Blocks of pixels against one depth, by tiles where those settle it.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, STALE, TILE, TILE_SHIFT
from simplifier.kernels.perspective import COLUMNS, FOCAL, NEAR, ROWS, project_point

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
        x, y, z = project_point(
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


EDGES, PLANES = 12, 3

_OUTLINE_UP = 1.0 + 2.0**-20  # for rounding, in favour of visible
_FLAT = 1e-9  # pixels; an edge that rises less has no slope


@kernel
def is_outline_hidden(boxes, index, view, depth, grown, corners, edges, planes):
    """Whether the depth buffer is nearer wherever one of ``boxes`` may be seen.

    ``view``, ``depth``  as for :mod:`box_verdict`; the box lies before the near plane.
    ``grown``   pixels that the outline grows by on all sides, 0 or more.
    ``corners`` (8, 2), ``edges`` (12, 4), ``planes`` (3, 3) float64: room to work in.
    """
    rows, columns = view[ROWS], view[COLUMNS]
    top, bottom, nearest = _project_corners(boxes, index, view, corners)
    _find_edges(corners, edges)
    count = _front_planes(boxes, index, view, grown + 0.5, planes)
    largest = _OUTLINE_UP / nearest
    first_row = np.int64(min(max(top - grown, 0.0), rows - 1.0))
    last_row = np.int64(min(max(bottom + grown, 0.0), rows - 1.0))
    for row in range(first_row, last_row + 1):
        left, right = _extent(edges, row - grown, row + 1.0 + grown)
        if not (left <= right and right + grown >= 0.0 and left - grown <= columns):
            continue
        first = np.int64(min(max(left - grown, 0.0), columns - 1.0))
        last = np.int64(min(max(right + grown, 0.0), columns - 1.0))
        if not _is_row_nearer(depth, row, first, last, planes, count, largest):
            return False
    return True


@inline_kernel
def _project_corners(boxes, index, view, corners):
    """Pixels of the corners; (top, bottom, least depth)."""
    top, bottom, nearest = np.inf, -np.inf, np.inf
    for corner in range(8):
        x, y, z = project_point(
            view, boxes[index, corner & 1, 0], boxes[index, (corner >> 1) & 1, 1],
            boxes[index, corner >> 2, 2],
        )  # fmt: skip
        corners[corner, 0], corners[corner, 1] = x / z, y / z
        top, bottom = min(top, y / z), max(bottom, y / z)
        nearest = min(nearest, z)
    return top, bottom, nearest


@inline_kernel
def _find_edges(corners, edges):
    """Fill ``edges``: least and largest y, x at the least, and the slope of x over y.

    An outline's edges are among the box's twelve, and the others lie within it.
    """
    count = 0
    for low in range(8):
        for axis in range(3):
            high = low | (1 << axis)
            if high == low:
                continue
            a, b = low, high
            if corners[a, 1] > corners[b, 1]:
                a, b = b, a
            rise = corners[b, 1] - corners[a, 1]
            edges[count, 0], edges[count, 1] = corners[a, 1], corners[b, 1]
            edges[count, 2] = corners[a, 0]
            edges[count, 3] = (corners[b, 0] - corners[a, 0]) / max(rise, _FLAT)
            count += 1


@inline_kernel
def _extent(edges, low, high):
    """Least and largest x of the outline between two heights."""
    left, right = np.inf, -np.inf
    for edge in range(EDGES):
        begin, end = max(edges[edge, 0], low), min(edges[edge, 1], high)
        if begin <= end:
            slope = edges[edge, 3]
            a = edges[edge, 2] + (begin - edges[edge, 0]) * slope
            b = edges[edge, 2] + (max(end, edges[edge, 0] + _FLAT) - edges[edge, 0]) * slope
            left, right = min(left, a, b), max(right, a, b)
    return left, right


@inline_kernel
def _front_planes(boxes, index, view, reach, planes):
    """Number of sides that face the camera; ``planes``: reciprocal depth as a + b column + c row.

    At the pixel's centre, plus what it may rise within ``reach`` pixels of it.
    """
    focal = view[FOCAL]
    middle_x, middle_y = 0.5 * view[COLUMNS], 0.5 * view[ROWS]
    count = 0
    for axis in range(3):
        camera = view[axis]
        gap = boxes[index, 0, axis] - camera
        if gap <= 0.0:
            gap = boxes[index, 1, axis] - camera
            if gap >= 0.0:
                continue
        ahead = view[9 + axis]
        across = (view[3 + axis] - middle_x * ahead) / focal
        down = (view[6 + axis] - middle_y * ahead) / focal
        b, c = across / (focal * gap), down / (focal * gap)
        a = ahead / gap - b * (middle_x - 0.5) - c * (middle_y - 0.5)
        planes[count, 0] = a + (abs(b) + abs(c)) * reach
        planes[count, 1], planes[count, 2] = b, c
        count += 1
    return count


@inline_kernel
def _is_row_nearer(depth, row, first, last, planes, count, largest):
    """Whether the buffer is nearer than the box in all of a row's pixels ``first`` to ``last``."""
    a0, b0 = planes[0, 0] + planes[0, 2] * row, planes[0, 1]
    a1, b1, a2, b2 = a0, b0, a0, b0
    if count > 1:
        a1, b1 = planes[1, 0] + planes[1, 2] * row, planes[1, 1]
    if count > 2:
        a2, b2 = planes[2, 0] + planes[2, 2] * row, planes[2, 1]
    for column in range(first, last + 1):
        entry = min(a0 + b0 * column, a1 + b1 * column, a2 + b2 * column) * _OUTLINE_UP
        if not depth[row, column] > min(entry, largest):
            return False
    return True


@kernel
def is_block_nearer(depth, tiles, value, first_row, last_row, first_column, last_column):
    """Whether all of a block of pixels are nearer.

    ``value``  float32, the reciprocal depth that they must exceed.
    """
    for tile_row in range(first_row >> TILE_SHIFT, (last_row >> TILE_SHIFT) + 1):
        for tile in range(first_column >> TILE_SHIFT, (last_column >> TILE_SHIFT) + 1):
            if not is_tile_nearer(depth, tiles, tile_row, tile, value):
                row, column = tile_row << TILE_SHIFT, tile << TILE_SHIFT
                least = least_of(
                    depth,
                    max(first_row, row), min(last_row, row + TILE - 1),
                    max(first_column, column), min(last_column, column + TILE - 1),
                )  # fmt: skip
                if not least > value:
                    return False
    return True


@inline_kernel
def largest_blur(tiles, first_row, last_row, first_column, last_column):
    """Largest screen error of the tiles of a block of pixels."""
    blur = np.float32(0.0)
    for tile_row in range(first_row >> TILE_SHIFT, (last_row >> TILE_SHIFT) + 1):
        for tile in range(first_column >> TILE_SHIFT, (last_column >> TILE_SHIFT) + 1):
            blur = max(blur, tiles[ERROR, tile_row, tile])
    return blur


@inline_kernel
def is_tile_nearer(depth, tiles, tile_row, tile, value):
    """Whether all pixels of a tile are nearer; a stale tile is made fresh when it would not be."""
    if tiles[FARTHEST, tile_row, tile] > value:
        return True
    if tiles[STALE, tile_row, tile] == 0.0:
        return False
    row, column = tile_row << TILE_SHIFT, tile << TILE_SHIFT
    tiles[STALE, tile_row, tile] = 0.0
    tiles[FARTHEST, tile_row, tile] = least_of(
        depth, row, row + TILE - 1, column, column + TILE - 1
    )
    return tiles[FARTHEST, tile_row, tile] > value


@kernel
def least_of(depth, first_row, last_row, first_column, last_column):
    """Least reciprocal depth of a block of pixels, ends included."""
    least = np.float32(np.inf)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            least = min(least, depth[row, column])
    return least
