"""Is a box hidden by a depth buffer, judged by its own outline and its own front?

Exacter than the screen rectangle at the depth of its nearest corner, and dearer.  A row of pixels
is tested where it meets the convex outline of the corners, and a pixel at the depth where its line
of sight enters the box: a plane's reciprocal depth is linear over the screen, and the line is in
the box only from behind all planes that face the camera, so the least of theirs is where it enters.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.perspective import COLUMNS, FOCAL, ROWS, projected

EDGES, PLANES = 12, 3

_UP = 1.0 + 2.0**-20  # for rounding, in favour of visible
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
    largest = _UP / nearest
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
        x, y, z = projected(
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
        entry = min(a0 + b0 * column, a1 + b1 * column, a2 + b2 * column) * _UP
        if not depth[row, column] > min(entry, largest):
            return False
    return True
