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
