"""Which item is nearest in each pixel: the picture that culling is judged by.

Fine meshes at a screen's resolution: most triangles lie between pixel centres, so all is arranged
for finding that out soon.  A vertex is projected once, to the packed cell of the first pixel centre
below and right of it; three equal columns or rows mean that no centre is in the bounding box.

Centres are covered by the same half-open spans as in :mod:`depth_buffer`.  Depths are reciprocal
and float64.  The nearest wins, of equals the lowest item, so the order of drawing does not matter.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.perspective import (
    COLUMNS,
    CORNERS,
    GUARD,
    NEAR,
    ROWS,
    clip,
    first_centre,
    is_drawable,
)

NOTHING = -1

_UNDRAWABLE = np.uint32(0xFFFFFFFF)  # no cell: the triangle goes through the clipper


@kernel(
    "float64[:, :], int32[:, :], int64, int64, float64[:, :], int32[:], float64[:], "
    "float64[:, :], uint32[:], float64[:, :], int32[:, :], int64[:]"
)
def draw_items(
    vertices, faces, begin, end, transform, items, view, points, cells, depth, picture, fragments
):
    """Draw both sides of ``faces[begin:end]``.

    ``vertices``   (n, 3) float64, ``faces`` (m, 3) int32.
    ``transform``  (3, 4) float64: from the mesh's space to homogeneous pixels.
    ``items``      (m,) int32 of the faces, or (1,): of all of them.
    ``view``       (16,) float64, :mod:`perspective`.
    ``points``     (n or more, 3) float64, ``cells`` (n or more,) uint32: room for projections.
    ``depth``      (rows, columns) float64, reciprocal.  ``picture`` int32, the item or -1.
    ``fragments``  int64 by item: pixel centres covered, once for each triangle that does.
    """
    _project(vertices, transform, view, points, cells)
    polygon, spare = np.empty((CORNERS, 3)), np.empty((CORNERS, 3))
    low_half = np.uint32(0xFFFF)
    for face in range(begin, end):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        p, q, r = cells[i], cells[j], cells[k]
        differ = (p ^ q) | (p ^ r)
        drawable = p != _UNDRAWABLE and q != _UNDRAWABLE and r != _UNDRAWABLE
        if drawable and ((differ & low_half) == 0 or (differ >> np.uint32(16)) == 0):
            continue
        item = items[face] if len(items) > 1 else items[0]
        if drawable:
            fragments[item] += _draw_triangle(points, i, j, k, item, view, depth, picture)
            continue
        count = _clip_face(vertices, i, j, k, transform, view, polygon, spare)
        for last in range(2, count):
            fragments[item] += _draw_triangle(
                polygon, 0, last - 1, last, item, view, depth, picture
            )


@inline_kernel
def _transform(transform, vertices, vertex):
    x, y, z = vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2]
    return (
        transform[0, 0] * x + transform[0, 1] * y + transform[0, 2] * z + transform[0, 3],
        transform[1, 0] * x + transform[1, 1] * y + transform[1, 2] * z + transform[1, 3],
        transform[2, 0] * x + transform[2, 1] * y + transform[2, 2] * z + transform[2, 3],
    )


@inner_kernel
def _project(vertices, transform, view, points, cells):
    """Pixel x and y with centres at the integers, the reciprocal depth, and the packed cell."""
    rows, columns, near = view[ROWS], view[COLUMNS], view[NEAR]
    for vertex in range(len(vertices)):
        x, y, z = _transform(transform, vertices, vertex)
        if is_drawable(x, y, z, near):
            scale = 1.0 / z
            x, y = x * scale - 0.5, y * scale - 0.5
            points[vertex, 0], points[vertex, 1], points[vertex, 2] = x, y, scale
            column = np.uint32(first_centre(x, columns))
            cells[vertex] = (np.uint32(first_centre(y, rows)) << np.uint32(16)) | column
        else:
            cells[vertex] = _UNDRAWABLE


@inner_kernel
def _clip_face(vertices, i, j, k, transform, view, polygon, spare):
    """Corners of what is left of a face, in ``polygon`` as :func:`_project` writes them."""
    for corner in range(3):
        vertex = i if corner == 0 else (j if corner == 1 else k)
        x, y, z = _transform(transform, vertices, vertex)
        polygon[corner, 0], polygon[corner, 1], polygon[corner, 2] = x, y, z
    count = clip(polygon, spare, view[NEAR], GUARD)
    for corner in range(count):
        scale = 1.0 / polygon[corner, 2]
        polygon[corner, 0] = polygon[corner, 0] * scale - 0.5
        polygon[corner, 1] = polygon[corner, 1] * scale - 0.5
        polygon[corner, 2] = scale
    return count


@inner_kernel
def _draw_triangle(points, a, b, c, item, view, depth, picture):
    """Returns how many centres are covered, whatever is nearer."""
    if points[a, 1] > points[b, 1]:
        a, b = b, a
    if points[b, 1] > points[c, 1]:
        b, c = c, b
    if points[a, 1] > points[b, 1]:
        a, b = b, a
    rows, columns = view[ROWS], view[COLUMNS]
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[c, 0], points[c, 1]
    bottom, bend, top = first_centre(ay, rows), first_centre(by, rows), first_centre(cy, rows)
    covered = 0
    for row in range(bottom, top):
        x0 = ax + (row - ay) * ((cx - ax) / (cy - ay))
        if row < bend:
            x1 = ax + (row - ay) * ((bx - ax) / (by - ay))
        else:
            x1 = bx + (row - by) * ((cx - bx) / (cy - by))
        first = first_centre(min(x0, x1), columns)
        end = first_centre(max(x0, x1), columns)
        if first < end:
            covered += end - first
            _fill_span(points, a, b, c, row, first, end, item, depth, picture)
    return covered


@inner_kernel
def _fill_span(points, a, b, c, row, first, end, item, depth, picture):
    px, py = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    qx, qy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    p, q = points[b, 2] - points[a, 2], points[c, 2] - points[a, 2]
    area = px * qy - qx * py
    slope_x, slope_y = (p * qy - q * py) / area, (q * px - p * qx) / area
    # Kept between the corners': a sliver's plane may overshoot.
    low = min(points[a, 2], points[b, 2], points[c, 2])
    high = max(points[a, 2], points[b, 2], points[c, 2])
    start = points[a, 2] + slope_y * (row - points[a, 1]) + slope_x * (first - points[a, 0])
    for column in range(first, end):
        value = min(max(start + slope_x * (column - first), low), high)
        if value > depth[row, column] or (
            value == depth[row, column] and item < picture[row, column]
        ):
            depth[row, column] = value
            picture[row, column] = item


@kernel("float64[:, :], int32[:, :], float64[:, :], int32[:, :]")
def merge_pictures(depth, picture, other_depth, other_picture):
    """The nearer of two pictures into the first; of equals the lower item."""
    for row in range(depth.shape[0]):
        for column in range(depth.shape[1]):
            value, item = other_depth[row, column], other_picture[row, column]
            if value > depth[row, column] or (
                value == depth[row, column] and item < picture[row, column]
            ):
                depth[row, column] = value
                picture[row, column] = item
