"""Occluders drawn into a small depth buffer, and boxes tested against it.

What is stored is the *reciprocal* of the view depth, float32: it is linear over the screen, larger
is nearer, 0 is nothing.  Tiles of 8 x 8 pixels keep the least of theirs (Greene, Kass, Miller:
Hierarchical Z-Buffer Visibility, with one level in place of a pyramid), so most boxes are settled
by a few tiles.  A tile that was drawn to is *stale*: its least is computed again when a box asks
for it and not before; until then the old one is still a lower bound: drawing only brings nearer.

Doubt always goes against the occluder.  Its depth is pushed away by its error bound e: the true
reciprocal of depth + e is s / (1 + e s) with s linear over the screen, which is concave in s, so
interpolating the corners' values linearly stays below it, on the far side.  Rounding to float32 is
paid for by pushing every value 2^-22 of the triangle's nearest further.

Occluders drawn into the pixels that lie wholly inside them.

A pixel's square is inside a half plane when its centre is, after the half plane's edge has moved
inwards by half of |a| + |b| with (a, b) the edge's normal (Akenine-Moeller and Aila: Conservative
and Tiled Rasterization Using a Modified Triangle Setup, with the sign turned).  A convex polygon is
the intersection of its half planes; what is stored is its farthest depth over the square.

All half planes of a polygon lie on the same side of their edges, by the sign of its area.  What a
point lies inwards of each edge, times the edge's length, adds up to twice the area, so a polygon
seen from its edge holds no square, whichever sign rounding gave it.  Sides chosen edge by edge
could, by rounding, all look the same way and hold half the screen.

Triangles T and U on both sides of an edge that they share would lose all pixels on it.  A square
inside the moved half planes of the other two edges of T and of the other two of U is inside their
union: its part on T's side of the shared edge is in T, the rest in U.  Its depth is the farther of
both planes over the square.  Pixels that three triangles share are lost, which is safe.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel
from simplifier.kernels.perspective import (
    COLUMNS,
    CORNERS,
    FOCAL,
    ROWS,
    clip_face,
    first_centre,
    project_points,
)

TILE = 8
TILE_SHIFT = 3  # TILE is 1 << TILE_SHIFT

FARTHEST, ERROR, STALE = 0, 1, 2
"""Layers of the tiles: least reciprocal depth, largest screen error in pixels, 1 where stale."""

THINNEST = 1e-4
"""Pixels; a thinner triangle's plane drowns in rounding, so its farthest corner stands for it."""

PUSH = 2.0**-22
"""Share of a triangle's nearest reciprocal depth that pays for rounding to float32."""

_UP = 1.0 + 2.0**-22  # before rounding to float32: the result is not below


@kernel
def draw_triangles(vertices, faces, errors, view, depth, tiles):
    """Draw both sides of ``faces`` where they cover pixel centres.

    ``vertices``  (n, 3) float64, world units.     ``faces``  (m, 3) int32.
    ``errors``    (m,) float64, world units, 0 or more, infinite: not drawn.
    ``view``      (16,) float64, :mod:`perspective`.
    ``depth``     (8 r, 8 c) float32, rows and columns past the screen infinite.
    ``tiles``     (3, r, c) float32.
    """
    points = np.empty((len(vertices), 3))
    polygon, spare = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    project_points(vertices, view, points)
    for face in range(len(faces)):
        if not errors[face] < np.inf:
            continue
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        nearest = min(points[i, 2], points[j, 2], points[k, 2])
        if nearest > 0.0:
            blur = errors[face] * view[FOCAL] / nearest
            _draw_triangle(points, i, j, k, errors[face], blur, view, depth, tiles)
            continue
        count = clip_face(vertices, i, j, k, view, polygon, spare)
        nearest = least_depth(polygon, count)
        for last in range(2, count):
            blur = errors[face] * view[FOCAL] / nearest
            _draw_triangle(polygon, 0, last - 1, last, errors[face], blur, view, depth, tiles)


@inline_kernel
def least_depth(polygon, count):
    """Of the corners of a polygon."""
    nearest = np.inf
    for corner in range(count):
        nearest = min(nearest, polygon[corner, 2])
    return nearest


@kernel
def plane_through(points, a, b, c, error):
    """Slopes along x and y of the pushed reciprocal depth, and its value at corner ``a``.

    Slopes of 0 and the farthest corner's value for a triangle too thin to have a plane.
    """
    p = 1.0 / (points[a, 2] + error)
    q = 1.0 / (points[b, 2] + error)
    r = 1.0 / (points[c, 2] + error)
    bx, by = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    cx, cy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    area = bx * cy - cx * by
    longest = max(abs(bx), abs(by), abs(cx), abs(cy), abs(bx - cx), abs(by - cy))
    push = PUSH * max(p, q, r)
    if not abs(area) > THINNEST * longest:
        return 0.0, 0.0, min(p, q, r) - push
    slope_x = ((q - p) * cy - (r - p) * by) / area
    slope_y = ((r - p) * bx - (q - p) * cx) / area
    return slope_x, slope_y, p - push


@kernel
def _draw_triangle(points, a, b, c, error, blur, view, depth, tiles):
    """``blur`` is the screen error, pixels.

    Row y belongs to a triangle when low <= y < high, and on it the centres from the left crossing,
    included, to the right one, excluded; a shared edge has the same crossings in both triangles.
    """
    if points[a, 1] > points[b, 1]:
        a, b = b, a
    if points[b, 1] > points[c, 1]:
        b, c = c, b
    if points[a, 1] > points[b, 1]:
        a, b = b, a
    rows, columns = view[ROWS], view[COLUMNS]
    bottom, top = first_centre(points[a, 1], rows), first_centre(points[c, 1], rows)
    if bottom >= top:
        return
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[c, 0], points[c, 1]
    if first_centre(min(ax, bx, cx), columns) >= first_centre(max(ax, bx, cx), columns):
        return
    bend = first_centre(by, rows)
    slope_x, slope_y, start = plane_through(points, a, b, c, error)
    long_slope = (cx - ax) / (cy - ay)
    first_column, last_column = np.int64(columns), np.int64(-1)
    # An edge without rows has an infinite slope, and is not used.
    other_x, other_y, other_slope = ax, ay, (bx - ax) / (by - ay)
    for row in range(bottom, top):
        if row == bend:
            other_x, other_y, other_slope = bx, by, (cx - bx) / (cy - by)
        x0 = ax + (row - ay) * long_slope
        x1 = other_x + (row - other_y) * other_slope
        first = first_centre(min(x0, x1), columns)
        end = first_centre(max(x0, x1), columns)
        if first < end:
            value = start + slope_x * (first - ax) + slope_y * (row - ay)
            fill_span(depth, row, first, end, value, slope_x)
            first_column = min(first_column, first)
            last_column = max(last_column, end - 1)
        if (row & (TILE - 1)) == TILE - 1 or row == top - 1:
            touch(tiles, row >> TILE_SHIFT, first_column, last_column, blur)
            first_column, last_column = np.int64(columns), np.int64(-1)


@inline_kernel
def fill_span(depth, row, first, end, value, slope):
    """The nearer of what is there and a plane; all centres must lie within the triangle."""
    start, step = np.float32(value), np.float32(slope)
    for column in range(end - first):
        here = start + np.float32(column) * step
        depth[row, first + column] = max(depth[row, first + column], here)


@inline_kernel
def touch(tiles, tile_row, first_column, last_column, blur):
    """The tiles of columns that were written to: stale, and at least as blurred."""
    for tile in range(first_column >> TILE_SHIFT, (last_column >> TILE_SHIFT) + 1):
        tiles[STALE, tile_row, tile] = 1.0
        tiles[ERROR, tile_row, tile] = max(tiles[ERROR, tile_row, tile], np.float32(blur * _UP))


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
def _area(points, a, b, c):
    """Twice the triangle's, above 0 where edge a -> b has c on the side of +1."""
    bx, by = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    cx, cy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return bx * cy - cx * by


@inline_kernel
def _set_plane(planes, index, points, p, q, side, inset):
    """The half plane on a side of edge p -> q, 1 or -1, moved inwards by ``inset`` squares."""
    a, b = points[p, 1] - points[q, 1], points[q, 0] - points[p, 0]
    planes[index, 0], planes[index, 1] = side * a, side * b
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
    area, bottom, top = 0.0, np.inf, -np.inf
    for corner in range(count):
        bottom, top = min(bottom, polygon[corner, 1]), max(top, polygon[corner, 1])
        if corner >= 2:
            area += _area(polygon, 0, corner - 1, corner)
    side = 1.0 if area > 0.0 else -1.0
    for corner in range(count):
        after = corner + 1 if corner + 1 < count else 0
        _set_plane(planes, corner, polygon, corner, after, side, _HALF)
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
    if _are_close(points, a, b):
        return
    side = 1.0 if _area(points, a, b, c) > 0.0 else -1.0
    if side * _area(points, a, b, d) > 0.0:
        return  # folded: both lie on one side
    _set_plane(planes, 0, points, a, b, side, -0.5)
    _set_plane(planes, 1, points, a, b, -side, -0.5)
    _set_plane(planes, 2, points, a, c, -side, _HALF)
    _set_plane(planes, 3, points, b, c, side, _HALF)
    _set_plane(planes, 4, points, a, d, side, _HALF)
    _set_plane(planes, 5, points, b, d, -side, _HALF)
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
