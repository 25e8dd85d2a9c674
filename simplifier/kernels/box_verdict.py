"""Is a box hidden by what a depth buffer holds?

As ``integrations/c/occluder_buffer.h`` tests it, number by number (:mod:`depth_buffer`).

A box is judged by its screen rectangle at the depth of its nearest corner, both on the safe side,
and where that does not settle it by its own outline and front, which find a third more hidden
boxes indoors; by the outline alone it would be nearly none.  Both grow by a margin for what the
occluders' outlines may be off: the largest screen error of the tiles that the rectangle meets,
which is asked again of the larger rectangle until it settles; half a pixel where centres count; and
the slack.

Outline and front are exacter than the rectangle, and dearer.  A row of pixels
is tested where it meets the convex outline of the corners, and a pixel at the depth where its line
of sight enters the box: a plane's reciprocal depth is linear over the screen, and the line is in
the box only from behind all planes that face the camera, so the least of theirs is where it enters.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.depth_buffer import (
    ERROR,
    FARTHEST,
    FOCAL,
    FOUR,
    HALF,
    LARGEST,
    MARGIN,
    NEAR,
    NEARER,
    ONE,
    PAST,
    ROUNDED,
    SLACK,
    TILE,
    TWO,
    ZERO,
    fresh,
)

VISIBLE, HIDDEN, OUTSIDE = 0, 1, 2

_ROUNDS = 8  # of the margin; a box that has not settled by then counts as visible


@kernel(
    "float64[:, :, :], float64[:], float32[:], float64[:, :], float64[:], int64[:], "
    "float32[:, :], float32[:, :, :], uint8[:]"
)
def judge_boxes(boxes, eye, screen, axes, lens, size, depth, tiles, verdicts):
    """Fill ``verdicts`` (n,) uint8 for ``boxes`` (n, 2, 3) float64, lowest and highest corners.

    ``eye``     (3,) float64, which is taken from them.
    ``screen``  (9,) float32: world axes to pixels times depth, and depth.
    ``axes``    (3, 3) float64: right, up and ahead.
    ``lens``, ``size``, ``depth``, ``tiles``  as in :mod:`depth_buffer`; stale tiles that decide are
                made fresh.
    """
    low, high = np.empty(3, dtype=np.float32), np.empty(3, dtype=np.float32)
    corners, edges = np.empty((2, 8), dtype=np.float32), np.empty((12, 7), dtype=np.float32)
    fronts, bounds = np.empty((3, 3), dtype=np.float32), np.empty(6, dtype=np.float32)
    for index in range(len(boxes)):
        for axis in range(3):
            low[axis] = np.float32(boxes[index, 0, axis] - eye[axis])
            high[axis] = np.float32(boxes[index, 1, axis] - eye[axis])
        verdicts[index] = box_verdict(
            low, high, screen, axes, lens, size, depth, tiles, corners, edges, fronts, bounds
        )


@inner_kernel
def box_verdict(
    low, high, screen, axes, lens, size, depth, tiles, corners, edges, fronts, bounds
):  # fmt: skip
    """VISIBLE, HIDDEN or OUTSIDE; what is not a number is visible.

    ``low``, ``high``  (3,) float32, around the eye.
    ``corners`` (2, 8), ``edges`` (12, 7), ``fronts`` (3, 3), ``bounds`` (6,) float32: to work in.
    """
    verdict = screen_outline(low, high, screen, lens, size, corners, bounds)
    if verdict != HIDDEN:
        return verdict
    left, right, top, bottom = bounds[0], bounds[1], bounds[2], bounds[3]
    value, margin = NEARER / bounds[4], np.float32(lens[MARGIN])
    # No margin is less than that of a tile which the box meets anyway.
    blur = tiles[ERROR, pixel(top, size[0]) // TILE, pixel(left, size[1]) // TILE]
    for _ in range(_ROUNDS):
        reach = margin + blur + bounds[5]
        first_row, last_row = pixel(top - reach, size[0]), pixel(bottom + reach, size[0])
        first, last = pixel(left - reach, size[1]), pixel(right + reach, size[1])
        needed = largest_blur(tiles, first_row, last_row, first, last)
        if needed <= blur:
            if is_block_nearer(depth, tiles, value, first_row, last_row, first, last):
                return HIDDEN
            if is_outline_hidden(
                low, high, axes, lens, size, depth, value, reach, corners, edges, fronts, bounds
            ):
                return HIDDEN
            return VISIBLE
        blur = needed
    return VISIBLE


@inner_kernel
def screen_outline(low, high, screen, lens, size, corners, bounds):
    """Fill ``corners`` (2, 8), pixels, and ``bounds`` (6,): left, right, top and bottom, the least
    depth, rounded down, and the pixels that all are off at most.

    OUTSIDE when all corners lie beyond one plane of the view frustum, VISIBLE when the box reaches
    before the near plane, and HIDDEN, which is to be proved, otherwise.
    """
    rows, columns = np.float32(size[0]), np.float32(size[1])
    focal, near = np.float32(lens[FOCAL]), np.float32(lens[NEAR])
    extent = (max(abs(low[0]), abs(high[0])) + max(abs(low[1]), abs(high[1]))) + max(
        abs(low[2]), abs(high[2])
    )
    doubt = ((((low[0] + low[1]) + low[2]) + high[0]) + high[1]) + high[2]
    if not (np.isfinite(doubt) and extent < LARGEST):
        return VISIBLE
    deep = ROUNDED * extent
    wide = deep * (focal + TWO * max(columns, rows))
    left, right, top, bottom, nearest, farthest = PAST, -PAST, PAST, -PAST, PAST, -PAST
    most_x, most_y, least_x, least_y = -PAST, -PAST, -PAST, -PAST
    for corner in range(8):
        px = high[0] if corner & 1 else low[0]
        py = high[1] if corner & 2 else low[1]
        pz = high[2] if corner & 4 else low[2]
        x = (screen[0] * px + screen[1] * py) + screen[2] * pz
        y = (screen[3] * px + screen[4] * py) + screen[5] * pz
        z = (screen[6] * px + screen[7] * py) + screen[8] * pz
        nearest, farthest = min(nearest, z), max(farthest, z)
        most_x, most_y = max(most_x, x), max(most_y, y)
        least_x, least_y = max(least_x, columns * z - x), max(least_y, rows * z - y)
        corners[0, corner], corners[1, corner] = x * (ONE / z), y * (ONE / z)
        left, right = min(left, corners[0, corner]), max(right, corners[0, corner])
        top, bottom = min(top, corners[1, corner]), max(bottom, corners[1, corner])
    if nearest - deep < near:
        if farthest + deep < near or most_x + wide < ZERO or most_y + wide < ZERO:
            return OUTSIDE
        return OUTSIDE if least_x + wide < ZERO or least_y + wide < ZERO else VISIBLE
    bounds[0], bounds[1], bounds[2], bounds[3] = left, right, top, bottom
    bounds[4] = nearest - deep
    bounds[5] = TWO * np.float32(lens[SLACK]) + wide / bounds[4]
    if right + bounds[5] < ZERO or left - bounds[5] > columns:
        return OUTSIDE
    return OUTSIDE if bottom + bounds[5] < ZERO or top - bounds[5] > rows else HIDDEN


@inline_kernel
def pixel(place, count):
    """The pixel of 0..count - 1 that holds a place, or the one at that end of the screen."""
    return np.int64(min(max(place, ZERO), np.float32(count - 1)))


@inner_kernel
def is_outline_hidden(
    low, high, axes, lens, size, depth, value, reach, corners, edges, fronts, bounds
):  # fmt: skip
    """Whether the depth buffer is nearer wherever a box may be seen.

    ``value``  the reciprocal depth of its nearest corner.
    ``reach``  pixels that the outline grows by on all sides.
    """
    rows, columns = size[0], size[1]
    count = front_planes(low, high, axes, lens, size, reach + HALF, fronts)
    # A corner and the one across the box: what lies between is within the outline.
    middle_x = HALF * (corners[0, 0] + corners[0, 7])
    middle_y = HALF * (corners[1, 0] + corners[1, 7])
    if ZERO <= middle_x < np.float32(columns) and ZERO <= middle_y < np.float32(rows):
        row, column = pixel(middle_y, rows), pixel(middle_x, columns)
        if not depth[row, column] > entry(fronts, count, value, row, column):
            return False  # as most that can be seen, without a look at the rest
    find_edges(corners, bounds, edges)
    first_row, last_row = pixel(bounds[2] - reach, rows), pixel(bounds[3] + reach, rows)
    for row in range(first_row, last_row + 1):
        begin = first_row + (row - first_row) // 8 * 8
        step = np.float32(row - begin)
        left, right = extents(
            edges, (np.float32(begin) - reach) + step, ((np.float32(begin) + ONE) + reach) + step
        )
        left, right = left - reach, right + reach
        if not (left <= right and right >= ZERO and left <= np.float32(columns)):
            continue
        for column in range(pixel(left, columns), pixel(right, columns) + 1):
            if not depth[row, column] > entry(fronts, count, value, row, column):
                return False
    return True


@inline_kernel
def entry(fronts, count, value, row, column):
    """The reciprocal depth at which the line of sight of a pixel enters a box."""
    result = value
    for k in range(count):
        result = min(
            result,
            (fronts[k, 0] + fronts[k, 2] * np.float32(row)) + fronts[k, 1] * np.float32(column),
        )
    return result


@inner_kernel
def find_edges(corners, bounds, edges):
    """Fill ``edges`` (12, 7): upper and lower y, x at the upper end, the slope of x over y, least
    and largest x, and the pixels that x may be off.

    An outline's edges are among the box's twelve, and the others lie within it.  Those that rise by
    less than a pixel have no slope, and count as a whole.
    """
    far_x, far_y = max(abs(bounds[0]), abs(bounds[1])), max(abs(bounds[2]), abs(bounds[3]))
    give = TWO * ROUNDED * max(far_x, far_y)
    count = 0
    for corner in range(8):
        for axis in range(3):
            upper, lower = corner, corner | (1 << axis)
            if upper == lower:
                continue
            if corners[1, upper] > corners[1, lower]:
                upper, lower = lower, upper
            edges[count, 0], edges[count, 1] = corners[1, upper], corners[1, lower]
            edges[count, 2] = corners[0, upper]
            rise = edges[count, 1] - edges[count, 0]
            edges[count, 3] = ZERO
            if rise > ONE:
                edges[count, 3] = (corners[0, lower] - corners[0, upper]) / rise
            edges[count, 4] = min(corners[0, upper], corners[0, lower])
            edges[count, 5] = max(corners[0, upper], corners[0, lower])
            edges[count, 6] = give * (ONE + abs(edges[count, 3]))
            count += 1


@inner_kernel
def extents(edges, low, high):
    """Least and largest x of the outline between two heights."""
    left, right = PAST, -PAST
    for edge in range(12):
        begin, end = max(edges[edge, 0], low), min(edges[edge, 1], high)
        if end < begin:
            continue
        here, there = edges[edge, 4], edges[edge, 5]
        if edges[edge, 1] - edges[edge, 0] > ONE:
            a = edges[edge, 2] + (begin - edges[edge, 0]) * edges[edge, 3]
            b = edges[edge, 2] + (end - edges[edge, 0]) * edges[edge, 3]
            here, there = min(a, b), max(a, b)
        left, right = min(left, here - edges[edge, 6]), max(right, there + edges[edge, 6])
    return left, right


@inner_kernel
def front_planes(low, high, axes, lens, size, reach, planes):
    """Number of sides that face the eye; ``planes``: reciprocal depth as a + b column + c row.

    At the pixel's centre, plus what it may rise within ``reach`` pixels of it and what rounding
    takes.
    """
    focal = np.float32(lens[FOCAL])
    middle_x, middle_y = HALF * np.float32(size[1]), HALF * np.float32(size[0])
    count = 0
    for axis in range(3):
        gap = low[axis] if low[axis] > ZERO else high[axis]
        if not (low[axis] > ZERO or high[axis] < ZERO):
            continue
        ahead = np.float32(axes[2, axis])
        b = np.float32(axes[0, axis]) / (focal * gap)
        c = np.float32(axes[1, axis]) / (-focal * gap)
        a = (ahead / gap - b * (middle_x - HALF)) - c * (middle_y - HALF)
        planes[count, 0] = (a + (abs(b) + abs(c)) * reach) + (FOUR * ROUNDED) * (
            (abs(ahead / gap) + (TWO * abs(b)) * middle_x) + (TWO * abs(c)) * middle_y
        )
        planes[count, 1], planes[count, 2] = b, c
        count += 1
    return count


@inner_kernel
def is_block_nearer(depth, tiles, value, first_row, last_row, first_column, last_column):
    """Whether all of a block of pixels are nearer.

    ``value``  float32, the reciprocal depth that they must exceed.
    """
    for tile_row in range(first_row // TILE, last_row // TILE + 1):
        for tile in range(first_column // TILE, last_column // TILE + 1):
            if (
                tiles[FARTHEST, tile_row, tile] > value
                or fresh(depth, tiles, tile_row, tile) > value
            ):
                continue
            for row in range(
                max(first_row, tile_row * TILE), min(last_row, tile_row * TILE + 7) + 1
            ):
                for column in range(
                    max(first_column, tile * TILE), min(last_column, tile * TILE + 7) + 1
                ):
                    if not depth[row, column] > value:
                        return False
    return True


@inner_kernel
def largest_blur(tiles, first_row, last_row, first_column, last_column):
    """Largest screen error of the tiles of a block of pixels."""
    blur = ZERO
    for tile_row in range(first_row // TILE, last_row // TILE + 1):
        for tile in range(first_column // TILE, last_column // TILE + 1):
            blur = max(blur, tiles[ERROR, tile_row, tile])
    return blur
