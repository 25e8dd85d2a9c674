"""Occluders drawn into a small depth buffer, as ``integrations/c/occluder_buffer.h`` draws them.

This is what culling runs on where that header could not be compiled, and the plain reading of it:
the same numbers of 32 bits are added in the same order, so that both fill a buffer bit by bit alike
(``tests/kernels/test_native.py``).  What eight lanes do there at once is a loop over eight here.

What is stored is the *reciprocal* of the view depth: it is linear over the screen, larger is
nearer, 0 is nothing.  Tiles of 8 x 8 pixels keep the least of theirs (Greene, Kass, Miller:
Hierarchical Z-Buffer Visibility, with one level in place of a pyramid), so that triangles behind
what is drawn are left out, and most boxes settled, by a few tiles.  A tile that was drawn to is
*stale*: its least is computed again when somebody asks for it and not before.

Triangles are drawn up to their edges' half planes, tile by tile (Pineda: A Parallel Algorithm for
Polygon Rasterization).

Doubt always goes against the occluder.  Its depth is pushed away by its error bound e: the true
reciprocal of depth + e is s / (1 + e s) with s linear over the screen, which is concave in s, so
interpolating the corners' values linearly stays below it, on the far side.  What rounding takes is
pushed away, too: a few units of 2^-20 of the nearest value, more for the planes of slender
triangles, and what a plane falls by within the ``slack``, the pixels that rounding may move
anything by.

Inner coverage draws occluders into the pixels that lie wholly inside them.  A pixel's square is
inside a half plane when its centre is, after the half plane's edge has moved inwards by half of
|a| + |b| with (a, b) the edge's normal (Akenine-Moeller and Aila: Conservative and Tiled
Rasterization Using a Modified Triangle Setup, with the sign turned).  A convex polygon is the
intersection of its half planes; what is stored is its farthest depth over the square.

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

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.perspective import clip

TILE = 8

FARTHEST, ERROR, STALE = 0, 1, 2
"""Layers of the tiles: least reciprocal depth, largest screen error in pixels, 1 where stale."""

FOCAL, NEAR, MARGIN, SLACK = 0, 1, 2, 3
"""Places in a lens: pixels of a unit length at unit depth, near plane, least margin, slack."""

GUARD = 4.0
"""Times the screen's longer side: pixels from its corner beyond which triangles are clipped."""

CORNERS = 8
"""A triangle clipped by the near plane and four guard planes has at most so many."""

ZERO, HALF, ONE, SEVEN = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(7.0)
TWO, FOUR, EIGHT = np.float32(2.0), np.float32(4.0), np.float32(8.0)

ROUNDED = np.float32(2.0**-20)
"""What a few roundings to 24 bits take."""

NEARER, FARTHER = np.float32(1.0 + 2.0**-20), np.float32(1.0 - 2.0**-20)
"""Factors that rounding cannot undo."""

LARGEST = np.float32(1e30)
"""Of a length or an error; products have to fit."""

PAST = np.float32(np.finfo(np.float32).max)
"""Of pixels past the screen, which are in nobody's way."""


@inline_kernel
def fresh(depth, tiles, row, column):
    """The least of a tile's pixels."""
    if tiles[STALE, row, column] != ZERO:
        tiles[STALE, row, column] = ZERO
        tiles[FARTHEST, row, column] = least_of(depth, row * TILE, column * TILE)
    return tiles[FARTHEST, row, column]


@inner_kernel
def least_of(depth, top, left):
    """The least of the pixels of a tile."""
    least = depth[top, left]
    for row in range(top, top + TILE):
        for column in range(left, left + TILE):
            least = min(least, depth[row, column])
    return least


@kernel(
    "float64[:, :], float64[:], int32[:, :], uint32[:, :], float32[:], float64[:], float64[:], "
    "int64[:], bool, float32[:, :], float32[:, :, :], float32[:, :]"
)
def draw(vertices, eye, faces, pairs, errors, screen, lens, size, inner, depth, tiles, points):
    """Draw both sides of ``faces`` where they cover pixels.

    ``vertices``  (n, 3) float64 in the world, and ``eye`` (3,) float64, which is taken from them.
    ``faces``     (m, 3) int32.
    ``pairs``     (k, 2) uint32: corners opposite of shared edges, drawn where ``inner``.
    ``errors``    (m,) or (1,) float32, world units, 0 or more; from LARGEST on not drawn.
    ``screen``    (9,) float64: world axes to pixels times depth, and depth.
    ``lens``      (4,) float64: FOCAL, NEAR, MARGIN and SLACK.
    ``size``      (2,) int64: rows and columns of the screen.
    ``inner``     whether pixels count only where they lie wholly in what is drawn.
    ``depth``     (8 r, 8 c) float32, what is past the screen PAST.
    ``tiles``     (3, r, c) float32.
    ``points``    (3, n or more) float32: room for pixels and depths, -1 for what is to be clipped.
    """
    transform = np.zeros(12, dtype=np.float32)
    transform[0], transform[5], transform[10] = ONE, ONE, ONE
    _draw(
        vertices, eye, transform, faces, pairs, errors, screen, lens, size, inner, depth, tiles,
        points,
    )  # fmt: skip


@kernel(
    "float32[:, :], float32[:], int32[:, :], uint32[:, :], float32[:], float64[:], float64[:], "
    "int64[:], bool, float32[:, :], float32[:, :, :], float32[:, :]"
)
def draw_placed(
    positions, transform, faces, pairs, errors, screen, lens, size, inner, depth, tiles, points
):
    """As :func:`draw`, of what has a space of its own.

    ``positions``  (n, 3) float32.
    ``transform``  (12,) float32: three rows that take (x, y, z, 1) to world axes around the eye.
    """
    _draw(
        positions, np.zeros(3), transform, faces, pairs, errors, screen, lens, size, inner, depth,
        tiles, points,
    )  # fmt: skip


@inner_kernel
def _draw(
    vertices, eye, transform, faces, pairs, errors, screen, lens, size, inner, depth, tiles, points,
):  # fmt: skip
    matrix = np.empty(12)
    for row in range(3):
        for column in range(4):
            matrix[4 * row + column] = (
                screen[3 * row] * transform[column] + screen[3 * row + 1] * transform[4 + column]
            ) + screen[3 * row + 2] * transform[8 + column]
    guard = GUARD * max(size[0], size[1])
    _project_points(vertices, eye, matrix, lens[NEAR], guard, points)
    polygon, spare = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    corners, room = np.empty((8, 10), dtype=np.float32), np.empty((8, 5), dtype=np.float32)
    edges, planes = np.empty((CORNERS, 7), dtype=np.float32), np.empty((2, 6), dtype=np.float32)
    outline = np.empty((CORNERS, 3), dtype=np.float32)
    for begin in range(0, len(faces), 8):
        count = min(len(faces) - begin, 8)
        chosen, behind = 0, 0
        for lane in range(count):
            face = begin + lane
            for corner in range(3):
                for axis in range(3):
                    corners[lane, 3 * corner + axis] = points[axis, faces[face, corner]]
            corners[lane, 9] = errors[face] if len(errors) > 1 else errors[0]
            if corners[lane, 9] < LARGEST:
                if min(corners[lane, 2], min(corners[lane, 5], corners[lane, 8])) < ZERO:
                    behind |= 1 << lane
                else:
                    chosen |= 1 << lane
        _draw_eight(corners, chosen, room, edges, planes, lens, size, inner, depth, tiles)
        for lane in range(count):
            if (behind >> lane) & 1:
                error = corners[lane, 9]
                for corner in range(3):
                    _project(vertices, faces[begin + lane, corner], eye, matrix, polygon, corner)
                sides = _clip_to_pixels(polygon, spare, lens[NEAR], guard, outline)
                if sides >= 3 and inner:
                    _draw_polygon(outline, sides, error, edges, planes, lens, size, depth, tiles)
                elif sides >= 3:
                    _draw_fan(outline, sides, error, room, edges, planes, lens, size, depth, tiles)
    if inner:
        _draw_pairs(faces, pairs, errors, edges, planes, lens, size, depth, tiles, points)


@inline_kernel
def _project(vertices, index, eye, matrix, out, place):
    """Homogeneous pixels of a vertex: pixels times depth, and depth."""
    x = np.float64(np.float32(vertices[index, 0] - eye[0]))
    y = np.float64(np.float32(vertices[index, 1] - eye[1]))
    z = np.float64(np.float32(vertices[index, 2] - eye[2]))
    for axis in range(3):
        out[place, axis] = (
            (matrix[4 * axis] * x + matrix[4 * axis + 1] * y) + matrix[4 * axis + 2] * z
        ) + matrix[4 * axis + 3]


@inner_kernel
def _project_points(vertices, eye, matrix, near, guard, points):
    """Pixels with centres at whole numbers, and depth; -1 for what cannot be divided by it."""
    at = np.empty((1, 3))
    for index in range(len(vertices)):
        _project(vertices, index, eye, matrix, at, 0)
        x, y, z = at[0, 0], at[0, 1], at[0, 2]
        if near <= z < np.float64(LARGEST) and abs(x) <= guard * z and abs(y) <= guard * z:
            share = 1.0 / z
            points[0, index] = np.float32(x * share - 0.5)
            points[1, index] = np.float32(y * share - 0.5)
            points[2, index] = np.float32(z)
        else:
            points[0, index], points[1, index], points[2, index] = ZERO, ZERO, -ONE


@inner_kernel
def _clip_to_pixels(polygon, spare, near, guard, outline):
    """Corners that are left of a triangle of homogeneous pixels, as :func:`_project_points` has
    them."""
    for corner in range(3):
        size = abs(polygon[corner, 0]) + abs(polygon[corner, 1]) + abs(polygon[corner, 2])
        if not size < np.float64(LARGEST):
            return 0
    count = clip(polygon, spare, near, guard)
    for corner in range(count):
        share = 1.0 / polygon[corner, 2]
        outline[corner, 0] = np.float32(polygon[corner, 0] * share - 0.5)
        outline[corner, 1] = np.float32(polygon[corner, 1] * share - 0.5)
        outline[corner, 2] = np.float32(polygon[corner, 2])
    return count


@inner_kernel
def _draw_eight(corners, chosen, room, edges, planes, lens, size, inner, depth, tiles):
    """Those of the first eight ``corners`` (8, 10) float32 whose bits are set: pixels and depths of
    three corners, and the error.  All are looked for behind what is drawn before any is drawn.

    ``room``  (8, 5) float32: the nearest value, and the pixels from left, top to right, bottom.
    """
    slack = np.float32(lens[SLACK])
    inset = HALF + slack if inner else -slack
    last_row, last_column = np.float32(size[0] - 1), np.float32(size[1] - 1)
    open_ = 0
    for lane in range(8):
        if not (chosen >> lane) & 1:
            continue
        ax, ay, az = corners[lane, 0], corners[lane, 1], corners[lane, 2]
        bx, by, bz = corners[lane, 3], corners[lane, 4], corners[lane, 5]
        cx, cy, cz = corners[lane, 6], corners[lane, 7], corners[lane, 8]
        left = max(np.ceil(min(ax, min(bx, cx)) + inset), ZERO)
        top = max(np.ceil(min(ay, min(by, cy)) + inset), ZERO)
        right = min(np.floor(max(ax, max(bx, cx)) - inset), last_column)
        bottom = min(np.floor(max(ay, max(by, cy)) - inset), last_row)
        if right < left or bottom < top:
            continue
        nearest = NEARER / (min(az, min(bz, cz)) + corners[lane, 9])
        room[lane, 0] = nearest
        room[lane, 1], room[lane, 2], room[lane, 3], room[lane, 4] = left, top, right, bottom
        if not _is_behind(room, lane, nearest, depth, tiles):
            open_ |= 1 << lane
    for lane in range(8):
        if (open_ >> lane) & 1:
            _draw_triangle(corners, lane, room, edges, planes, lens, inset, inner, depth, tiles)


@inner_kernel
def _is_behind(room, lane, nearest, depth, tiles):
    """Whether all tiles that a triangle's pixels are in are as near as its nearest value."""
    for row in range(np.int64(room[lane, 2]) >> 3, (np.int64(room[lane, 4]) >> 3) + 1):
        for column in range(np.int64(room[lane, 1]) >> 3, (np.int64(room[lane, 3]) >> 3) + 1):
            if tiles[FARTHEST, row, column] >= nearest:
                continue
            if not fresh(depth, tiles, row, column) >= nearest:
                return False
    return True


@inner_kernel
def _draw_triangle(corners, lane, room, edges, planes, lens, inset, inner, depth, tiles):
    slack, error = np.float32(lens[SLACK]), corners[lane, 9]
    ax, ay, az = corners[lane, 0], corners[lane, 1], corners[lane, 2]
    bx, by, bz = corners[lane, 3], corners[lane, 4], corners[lane, 5]
    cx, cy, cz = corners[lane, 6], corners[lane, 7], corners[lane, 8]
    nearest = room[lane, 0]
    p, q, r = ONE / (az + error), ONE / (bz + error), ONE / (cz + error)
    ux, uy, vx, vy = bx - ax, by - ay, cx - ax, cy - ay
    area = ux * vy - vx * uy
    wide = max(ax, max(bx, cx)) - min(ax, min(bx, cx))
    high = max(ay, max(by, cy)) - min(ay, min(by, cy))
    if not max(wide, high) * slack < abs(area):
        return  # thinner than what rounding may move its corners it has no plane
    share = ONE / area
    dq, dr = q - p, r - p
    slope_x = (dq * vy - dr * uy) * share
    slope_y = (dr * ux - dq * vx) * share
    slender = ONE + abs((wide * high) * share)
    spread = abs(slope_x) * (wide + EIGHT) + abs(slope_y) * (high + EIGHT)
    spare = HALF + TWO * slack if inner else TWO * slack
    push = ROUNDED * (nearest + spread * slender) + spare * (abs(slope_x) + abs(slope_y))
    planes[0, 0], planes[0, 1], planes[0, 2] = slope_x, slope_y, p - push
    planes[0, 3], planes[0, 4] = ax, ay
    planes[0, 5] = min(p, min(q, r)) * FARTHER
    blur = (error * (np.float32(lens[FOCAL]) * NEARER)) / min(az, min(bz, cz))
    sign = -ONE if area < ZERO else ONE
    set_edge(edges, 0, ax, ay, bx, by, sign, inset)
    set_edge(edges, 1, bx, by, cx, cy, sign, inset)
    set_edge(edges, 2, cx, cy, ax, ay, sign, inset)
    fill_region(
        edges, 3, planes, 1, nearest, blur, np.int64(room[lane, 1]), np.int64(room[lane, 2]),
        np.int64(room[lane, 3]), np.int64(room[lane, 4]), depth, tiles,
    )  # fmt: skip


@inline_kernel
def set_edge(edges, place, from_x, from_y, to_x, to_y, sign, inset):
    """The side of an edge that lies to the left of it where ``sign`` is 1, ``inset`` squares in.

    ``edges``  (8, 7) float32 of half planes a (x - px) + b (y - py) + c >= 0: a, b, c, px, py, and
               by what their values may grow and fall within a tile.
    """
    a, b = sign * (from_y - to_y), sign * (to_x - from_x)
    edges[place, 0], edges[place, 1] = a, b
    edges[place, 2] = -inset * (abs(a) + abs(b))
    edges[place, 3], edges[place, 4] = from_x, from_y
    edges[place, 5] = SEVEN * (max(a, ZERO) + max(b, ZERO))
    edges[place, 6] = SEVEN * (min(a, ZERO) + min(b, ZERO))


@inline_kernel
def plane_at(planes, place, x, y):
    """Of ``planes`` (2, 6) float32: slopes, a value and the pixel that it is of, the least."""
    return (planes[place, 2] + planes[place, 0] * (x - planes[place, 3])) + planes[place, 1] * (
        y - planes[place, 4]
    )


@inner_kernel
def fill_region(
    edges, count, planes, several, nearest, blur, left, top, right, bottom, depth, tiles
):  # fmt: skip
    """Draw the pixels of a block that are inside of ``count`` half planes, where they are nearer.

    ``several``  planes, 1 or 2, of which the farther holds; ``nearest`` is no less than its values.
    """
    starts = np.empty(CORNERS, dtype=np.float32)
    for row in range(top >> 3, (bottom >> 3) + 1):
        for column in range(left >> 3, (right >> 3) + 1):
            if tiles[FARTHEST, row, column] >= nearest:
                continue
            x, y = np.float32(8 * column), np.float32(8 * row)
            first = max(top - 8 * row, 0)
            beside = False
            for k in range(count):
                value = edges[k, 2] + (
                    edges[k, 0] * (x - edges[k, 3]) + edges[k, 1] * (y - edges[k, 4])
                )
                beside |= value + edges[k, 5] < ZERO
                starts[k] = value + edges[k, 1] * np.float32(first)
            if beside or fresh(depth, tiles, row, column) >= nearest:
                continue
            tiles[STALE, row, column] = ONE
            tiles[ERROR, row, column] = max(tiles[ERROR, row, column], blur)
            fill_tile(
                edges, count, starts, planes, several, 8 * row, 8 * column, first,
                min(bottom - 8 * row, 7), max(left - 8 * column, 0), min(right - 8 * column, 7),
                depth,
            )  # fmt: skip


@inner_kernel
def fill_tile(
    edges, count, starts, planes, several, top, left, first, last, begin, end, depth
):  # fmt: skip
    """Those in lines ``first`` to ``last`` and columns ``begin`` to ``end`` of a tile.

    ``starts``  (8,) float32 of the half planes in the first of these lines, at the tile's left end.
    """
    x, y = np.float32(left), np.float32(top)
    start = plane_at(planes, 0, x, y) + planes[0, 1] * np.float32(first)
    other = start
    if several > 1:
        other = plane_at(planes, 1, x, y) + planes[1, 1] * np.float32(first)
    a, b, c = edges[0, 1], edges[1, 1], edges[2, 1]
    for lane in range(begin, end + 1):
        along = np.float32(lane)
        here, there = start + planes[0, 0] * along, other + planes[1, 0] * along
        p, q = starts[0] + edges[0, 0] * along, starts[1] + edges[1, 0] * along
        r = starts[2] + edges[2, 0] * along
        for line in range(top + first, top + last + 1):
            inside = not (p < ZERO or q < ZERO or r < ZERO)
            if inside and count > 3:
                inside = is_inside(edges, count, starts, along, line - top - first)
            value = max(here, planes[0, 5])
            if several > 1:
                value = min(value, max(there, planes[1, 5]))
                there += planes[1, 1]
            if inside and value > depth[line, left + lane]:
                depth[line, left + lane] = value
            p, q, r = p + a, q + b, r + c
            here += planes[0, 1]


@inner_kernel
def is_inside(edges, count, starts, along, steps):
    """Of the half planes from the fourth on, so many lines below the first."""
    for k in range(3, count):
        value = starts[k] + edges[k, 0] * along
        for _ in range(steps):
            value += edges[k, 1]
        if value < ZERO:
            return False
    return True


@inner_kernel
def _draw_fan(outline, sides, error, room, edges, planes, lens, size, depth, tiles):
    """The triangles of a clipped one, by the centres of pixels."""
    fan = np.empty((8, 10), dtype=np.float32)
    for lane in range(sides - 2):
        for axis in range(3):
            fan[lane, axis] = outline[0, axis]
            fan[lane, 3 + axis] = outline[lane + 1, axis]
            fan[lane, 6 + axis] = outline[lane + 2, axis]
        fan[lane, 9] = error
    chosen = (1 << (sides - 2)) - 1
    _draw_eight(fan, chosen, room, edges, planes, lens, size, False, depth, tiles)


@inline_kernel
def area_of(points, a, b, c):
    """Twice the triangle's, above 0 where edge a -> b has c on the side of +1."""
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[c, 0] - points[a, 0]
    ) * (points[b, 1] - points[a, 1])


@inner_kernel
def plane_of(points, count, a, b, c, error, spare, slack, planes, place):
    """Set a plane through three of ``points`` (count, 3) float32, pixels and depths, pushed away by
    ``error`` and by what rounding takes over all of them.

    ``spare``  pixels around them that are paid for, too.

    False where the three are too thin for a plane; it is level then, at the farthest of the points.
    """
    low_x, low_y, low_z = points[0, 0], points[0, 1], points[0, 2]
    high_x, high_y, high_z = low_x, low_y, low_z
    for corner in range(1, count):
        low_x, high_x = min(low_x, points[corner, 0]), max(high_x, points[corner, 0])
        low_y, high_y = min(low_y, points[corner, 1]), max(high_y, points[corner, 1])
        low_z, high_z = min(low_z, points[corner, 2]), max(high_z, points[corner, 2])
    p = ONE / (points[a, 2] + error)
    dq, dr = ONE / (points[b, 2] + error) - p, ONE / (points[c, 2] + error) - p
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    area = ux * vy - vx * uy
    wide, tall = high_x - low_x, high_y - low_y
    planes[place, 5] = ONE / (high_z + error) * FARTHER
    planes[place, 0], planes[place, 1], planes[place, 2] = ZERO, ZERO, planes[place, 5]
    planes[place, 3], planes[place, 4] = points[a, 0], points[a, 1]
    if not abs(area) > max(wide, tall) * slack:
        return False
    share = ONE / area
    slope_x, slope_y = (dq * vy - dr * uy) * share, (dr * ux - dq * vx) * share
    spread = abs(slope_x) * (wide + EIGHT) + abs(slope_y) * (tall + EIGHT)
    planes[place, 0], planes[place, 1] = slope_x, slope_y
    planes[place, 2] = (
        p
        - ROUNDED * (NEARER / (low_z + error) + spread * (ONE + abs(wide * tall * share)))
        - (spare + TWO * slack) * (abs(slope_x) + abs(slope_y))
    )
    return True


@inner_kernel
def _draw_polygon(outline, sides, error, edges, planes, lens, size, depth, tiles):
    """A convex polygon, into the pixels that lie wholly in it.

    The pushed corners of a clipped one do not lie in a plane: there s / (1 + e s) is replaced by
    its chord from the farthest corner's s to the nearest one's, which is nowhere nearer.
    """
    slack = np.float32(lens[SLACK])
    inset = HALF + slack
    low_x, low_y, low_z = outline[0, 0], outline[0, 1], outline[0, 2]
    high_x, high_y, high_z = low_x, low_y, low_z
    for corner in range(1, sides):
        low_x, high_x = min(low_x, outline[corner, 0]), max(high_x, outline[corner, 0])
        low_y, high_y = min(low_y, outline[corner, 1]), max(high_y, outline[corner, 1])
        low_z, high_z = min(low_z, outline[corner, 2]), max(high_z, outline[corner, 2])
    left, top, right, bottom = held(
        low_x + inset, low_y + inset, high_x - inset, high_y - inset, size
    )
    if left > right or top > bottom:
        return
    area, largest, best = ZERO, -ONE, 2
    for corner in range(2, sides):
        part = area_of(outline, 0, corner - 1, corner)
        area += part
        if abs(part) > largest:
            best, largest = corner, abs(part)
    sign = ONE if area > ZERO else -ONE
    for corner in range(sides):
        after = corner + 1 if corner + 1 < sides else 0
        set_edge(
            edges, corner, outline[corner, 0], outline[corner, 1], outline[after, 0],
            outline[after, 1], sign, inset,
        )  # fmt: skip
    most, least = NEARER / low_z, FARTHER / high_z
    if plane_of(outline, sides, 0, best - 1, best, ZERO, HALF, slack, planes, 0):
        chord = FARTHER / ((ONE + error * least) * (ONE + error * most))
        planes[0, 2] = (
            chord * (planes[0, 2] - least) + least / (ONE + error * least) - ROUNDED * most
        )
        planes[0, 0], planes[0, 1] = planes[0, 0] * chord, planes[0, 1] * chord
        planes[0, 5] = FARTHER * (ONE / (high_z + error))
    else:
        planes[0, 2] = planes[0, 5] = FARTHER * (ONE / (high_z + error))
    fill_region(
        edges, sides, planes, 1, NEARER / (low_z + error),
        error * (np.float32(lens[FOCAL]) * NEARER) / low_z, left, top, right, bottom, depth, tiles,
    )  # fmt: skip


@inline_kernel
def held(left, top, right, bottom, size):
    """The whole pixels of a block on the screen; where there are none, an end is before a begin."""
    last_row, last_column = np.float32(size[0] - 1), np.float32(size[1] - 1)
    if not (left <= last_column and right >= ZERO and top <= last_row and bottom >= ZERO):
        return 1, 1, 0, 0
    return (
        np.int64(np.ceil(max(left, ZERO))), np.int64(np.ceil(max(top, ZERO))),
        np.int64(np.floor(min(right, last_column))), np.int64(np.floor(min(bottom, last_row))),
    )  # fmt: skip


@inner_kernel
def _draw_pairs(faces, pairs, errors, edges, planes, lens, size, depth, tiles, points):
    corners = np.empty((4, 3), dtype=np.float32)
    for pair in range(len(pairs)):
        one, two = np.int64(pairs[pair, 0]), np.int64(pairs[pair, 1])
        face, k = one // 3, one % 3
        error = errors[face] if len(errors) > 1 else errors[0]
        other = errors[two // 3] if len(errors) > 1 else errors[0]
        nearest = ONE
        for place in range(4):
            if place == 3:
                vertex = faces[two // 3, two % 3]
            else:
                vertex = faces[face, (k + 1 + place) % 3]
            for axis in range(3):
                corners[place, axis] = points[axis, vertex]
            nearest = min(nearest, corners[place, 2])
        if nearest >= ZERO and max(error, other) < LARGEST:
            draw_pair(corners, error, other, edges, planes, lens, size, depth, tiles)


@inner_kernel
def draw_pair(corners, error, other, edges, planes, lens, size, depth, tiles):
    """The pixels across a shared edge that lie in both triangles together.

    ``corners``  (4, 3) float32: the ends of the edge, then the corners opposite of it.
    """
    slack = np.float32(lens[SLACK])
    sign = ONE if area_of(corners, 0, 1, 2) > ZERO else -ONE
    if area_of(corners, 0, 1, 2) == ZERO or sign * area_of(corners, 0, 1, 3) >= ZERO:
        return  # no area, or folded: both lie on one side
    left, top, right, bottom = held(
        min(corners[0, 0], corners[1, 0]) - ONE, min(corners[0, 1], corners[1, 1]) - ONE,
        max(corners[0, 0], corners[1, 0]) + ONE, max(corners[0, 1], corners[1, 1]) + ONE, size,
    )  # fmt: skip
    if left > right or top > bottom:
        return
    inset = HALF + slack
    for place in range(6):
        # Around either triangle; the shared edge holds what it passes through.
        side, step = place // 3, place % 3
        third = 2 + side
        begin = (0 if side == 0 else 1) if step == 0 else (third if step == 2 else 1 - side)
        end = (1 if side == 0 else 0) if step == 0 else (side if step == 2 else third)
        set_edge(
            edges, place, corners[begin, 0], corners[begin, 1], corners[end, 0], corners[end, 1],
            sign, -HALF if step == 0 else inset,
        )  # fmt: skip
    plane_of(corners, 3, 0, 1, 2, error, HALF, slack, planes, 0)
    triangle = np.empty((3, 3), dtype=np.float32)
    for axis in range(3):
        triangle[0, axis], triangle[1, axis] = corners[0, axis], corners[1, axis]
        triangle[2, axis] = corners[3, axis]
    plane_of(triangle, 3, 0, 1, 2, other, HALF, slack, planes, 1)
    nearest = min(min(corners[0, 2], corners[1, 2]), min(corners[2, 2], corners[3, 2]))
    fill_region(
        edges, 6, planes, 2, NEARER / (nearest + min(error, other)),
        max(error, other) * (np.float32(lens[FOCAL]) * NEARER) / nearest, left, top, right, bottom,
        depth, tiles,
    )  # fmt: skip
