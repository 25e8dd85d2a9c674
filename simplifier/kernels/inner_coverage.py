"""Occluders drawn into the pixels that lie wholly inside them.

A pixel's square is inside a half plane when its centre is, after the half plane's edge has moved
inwards by half of |a| + |b| with (a, b) the edge's normal (Akenine-Moeller and Aila: Conservative
and Tiled Rasterization Using a Modified Triangle Setup, with the sign turned).  A convex polygon is
the intersection of its half planes; what is stored is its farthest depth over the square.

Triangles T and U on both sides of an edge that they share would lose all pixels on it.  A square
inside the moved half planes of the other two edges of T and of the other two of U is inside their
union: its part on T's side of the shared edge is in T, the rest in U.  Its depth is the farther of
both planes over the square.  Pixels that three triangles share are lost, which is safe.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.depth_buffer import (
    PUSH,
    THINNEST,
    TILE_SHIFT,
    fill_span,
    least_depth,
    plane_through,
    touch,
)
from simplifier.kernels.perspective import (
    COLUMNS,
    CORNERS,
    FOCAL,
    ROWS,
    clip_face,
    first_centre,
    project_points,
)

_HALF = 0.5 + THINNEST  # pixels; the excess pays for rounding
_PLANES = 8


@kernel
def draw_inside(vertices, faces, edges, errors, view, depth, tiles):
    """As :func:`depth_buffer.draw_triangles`, into pixels wholly inside.

    ``edges``  (k, 6) int32: the ends of an edge that two faces share, their third corners, and the
               two faces; each pair of faces at most once.
    """
    points = np.empty((len(vertices), 3))
    polygon, spare = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    planes = np.empty((_PLANES, 5))
    project_points(vertices, view, points)
    for face in range(len(faces)):
        if not errors[face] < np.inf:
            continue
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        count = 3
        if min(points[i, 2], points[j, 2], points[k, 2]) > 0.0:
            for axis in range(3):
                polygon[0, axis] = points[i, axis]
                polygon[1, axis] = points[j, axis]
                polygon[2, axis] = points[k, axis]
        else:
            count = clip_face(vertices, i, j, k, view, polygon, spare)
        count = _without_short_edges(polygon, count)
        if count >= 3:
            _draw_polygon(polygon, count, errors[face], planes, view, depth, tiles)
    for edge in range(len(edges)):
        error, other = errors[edges[edge, 4]], errors[edges[edge, 5]]
        if max(error, other) < np.inf:
            _draw_pair(points, edges[edge], error, other, planes, view, depth, tiles)


@kernel
def _without_short_edges(polygon, count):
    """Leave corners out that are so near to the next that the edge has no direction.

    What is left lies within the polygon.
    """
    kept = 0
    for corner in range(count):
        after = corner + 1 if corner + 1 < count else 0
        if not _are_close(polygon, corner, after):
            for axis in range(3):
                polygon[kept, axis] = polygon[corner, axis]
            kept += 1
    return kept


@inline_kernel
def _are_close(points, a, b):
    gap = max(abs(points[a, 0] - points[b, 0]), abs(points[a, 1] - points[b, 1]))
    return gap < THINNEST


@inline_kernel
def _set_plane(planes, index, points, p, q, x, y, inset):
    """The half plane of edge p -> q that holds (x, y), moved inwards by ``inset`` squares."""
    a, b = points[p, 1] - points[q, 1], points[q, 0] - points[p, 0]
    sign = 1.0 if a * (x - points[p, 0]) + b * (y - points[p, 1]) > 0.0 else -1.0
    planes[index, 0], planes[index, 1] = sign * a, sign * b
    planes[index, 2], planes[index, 3] = points[p, 0], points[p, 1]
    planes[index, 4] = inset * (abs(a) + abs(b))


@kernel
def _span(planes, count, row, columns):
    """First column and the one past the last whose centres are in all half planes."""
    low, high = 0.0, columns - 1.0
    for index in range(count):
        a = planes[index, 0]
        rest = planes[index, 4] - planes[index, 1] * (row - planes[index, 3])
        if a > 0.0:
            low = max(low, planes[index, 2] + rest / a)
        elif a < 0.0:
            high = min(high, planes[index, 2] + rest / a)
        elif rest > 0.0:
            return 0, 0
    if low > high:
        return 0, 0
    return np.int64(np.ceil(low)), np.int64(np.floor(high)) + 1


@kernel
def _draw_polygon(polygon, count, error, planes, view, depth, tiles):
    x, y, bottom, top = 0.0, 0.0, np.inf, -np.inf
    for corner in range(count):
        x, y = x + polygon[corner, 0] / count, y + polygon[corner, 1] / count
        bottom, top = min(bottom, polygon[corner, 1]), max(top, polygon[corner, 1])
    for corner in range(count):
        after = corner + 1 if corner + 1 < count else 0
        _set_plane(planes, corner, polygon, corner, after, x, y, _HALF)
    slope_x, slope_y, start = _polygon_plane(polygon, count, error)
    start -= 0.5 * (abs(slope_x) + abs(slope_y))
    blur = error * view[FOCAL] / least_depth(polygon, count)
    columns = view[COLUMNS]
    for row in range(first_centre(bottom, view[ROWS]), first_centre(top, view[ROWS])):
        first, end = _span(planes, count, row, columns)
        if first < end:
            value = start + slope_x * (first - polygon[0, 0]) + slope_y * (row - polygon[0, 1])
            fill_span(depth, row, first, end, value, slope_x)
            touch(tiles, row >> TILE_SHIFT, first, end - 1, blur)


@kernel
def _polygon_plane(polygon, count, error):
    """Slopes and value at the first corner of a plane that is nowhere nearer than the occluder.

    A triangle's pushed corners span a plane.  Those of a clipped one do not: there f(s) =
    s / (1 + e s) is replaced by its chord from the farthest corner's s to the nearest one's.
    """
    if count == 3:
        return plane_through(polygon, 0, 1, 2, error)
    best, largest = 2, -1.0
    least, most = np.inf, 0.0
    for corner in range(count):
        least, most = min(least, 1.0 / polygon[corner, 2]), max(most, 1.0 / polygon[corner, 2])
        if corner >= 2:
            px, py = polygon[corner - 1, 0] - polygon[0, 0], polygon[corner - 1, 1] - polygon[0, 1]
            qx, qy = polygon[corner, 0] - polygon[0, 0], polygon[corner, 1] - polygon[0, 1]
            if abs(px * qy - qx * py) > largest:
                best, largest = corner, abs(px * qy - qx * py)
    slope_x, slope_y, start = plane_through(polygon, 0, best - 1, best, 0.0)
    chord = 1.0 / ((1.0 + error * least) * (1.0 + error * most))
    start = chord * (start - least) + least / (1.0 + error * least) - PUSH * most
    return chord * slope_x, chord * slope_y, start


@kernel
def _draw_pair(points, edge, error, other, planes, view, depth, tiles):
    """The pixels across the shared edge that lie in both triangles together."""
    a, b, c, d = edge[0], edge[1], edge[2], edge[3]
    if min(points[a, 2], points[b, 2], points[c, 2], points[d, 2]) <= 0.0:
        return
    if (
        _are_close(points, a, b) or _are_close(points, a, c) or _are_close(points, b, c)
        or _are_close(points, a, d) or _are_close(points, b, d)
    ):  # fmt: skip
        return
    cx, cy, dx, dy = points[c, 0], points[c, 1], points[d, 0], points[d, 1]
    _set_plane(planes, 0, points, a, b, cx, cy, -0.5)
    _set_plane(planes, 1, points, a, b, dx, dy, -0.5)
    if planes[0, 0] * planes[1, 0] + planes[0, 1] * planes[1, 1] > 0.0:
        return  # folded: both lie on one side
    _set_plane(planes, 2, points, a, c, points[b, 0], points[b, 1], _HALF)
    _set_plane(planes, 3, points, b, c, points[a, 0], points[a, 1], _HALF)
    _set_plane(planes, 4, points, a, d, points[b, 0], points[b, 1], _HALF)
    _set_plane(planes, 5, points, b, d, points[a, 0], points[a, 1], _HALF)
    bottom = first_centre(min(points[a, 1], points[b, 1]) - 1.0, view[ROWS])
    top = first_centre(max(points[a, 1], points[b, 1]) + 1.0, view[ROWS])
    nearest = min(points[a, 2], points[b, 2], points[c, 2], points[d, 2])
    blur = max(error, other) * view[FOCAL] / nearest
    for row in range(bottom, top):
        first, end = _span(planes, 6, row, view[COLUMNS])
        if first < end:
            _fill_pair(points, a, b, c, d, error, other, row, first, end, depth)
            touch(tiles, row >> TILE_SHIFT, first, end - 1, blur)


@kernel
def _fill_pair(points, a, b, c, d, error, other, row, first, end, depth):
    """A few pixels, in float64: outside of a thin triangle its plane may be steep."""
    px, py, p = plane_through(points, a, b, c, error)
    qx, qy, q = plane_through(points, a, b, d, other)
    p += py * (row - points[a, 1]) - 0.5 * (abs(px) + abs(py))
    q += qy * (row - points[a, 1]) - 0.5 * (abs(qx) + abs(qy))
    # Within a triangle nothing is farther than its farthest corner, whatever its plane says.
    p_least = (1.0 - PUSH) / (max(points[a, 2], points[b, 2], points[c, 2]) + error)
    q_least = (1.0 - PUSH) / (max(points[a, 2], points[b, 2], points[d, 2]) + other)
    for column in range(first, end):
        here = column - points[a, 0]
        value = np.float32(min(max(p + px * here, p_least), max(q + qx * here, q_least)))
        depth[row, column] = max(depth[row, column], value)
