"""Pixels of a mesh before which an occluder stands, and by more than a threshold.

Centres are covered as in :mod:`simplifier.kernels.coverage`, bit for bit, and nothing is kept of a
mesh but what its pictures still lack.  A pixel is settled by the first of the mesh's triangles that
is no further behind the occluder than the threshold, or by any where the occluder does not show.
Most triangles of a fine mesh are left out as soon as their box holds settled pixels alone; depths
are worked out for the few others.
"""

from __future__ import annotations

import importlib

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one, popcount
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.compiled.waiting import load_imported
from simplifier.kernels.coverage import Known, by_contours, drawable
from simplifier.kernels.faces import (
    box_columns,
    lies_between,
    project,
    rows_of,
    run_of_ones,
    set_span,
)
from simplifier.kernels.threads import run_chunks

_NARROWEST = 1e-9  # pixels

_SIDE, _PICTURES = 128, 256
"""Pixels a side of the smallest pictures that are drawn of a mesh, and how many there are."""

LEAST_FACES = 1 << 13
"""Triangles of a mesh whose front is counted by contours.  A smaller mesh would gain less than a
tenth of a second, and the kernels for it take two seconds to compile."""


def load_for(faces: int) -> None:
    """Put in place what a run calls, with the kernels that a mesh of so many triangles is drawn by,
    and its front counted.

    What is missing is compiled together, on all processors.  Kernels that were imported later would
    be compiled one after the other, by one processor.  To be called before the clocks start: to
    compile is part of no stage, and of no time limit.
    """
    if faces >= LEAST_FACES:
        importlib.import_module("simplifier.kernels.front_contours")
    elif by_contours(faces, _PICTURES, _SIDE * _SIDE):
        importlib.import_module("simplifier.kernels.contours")
    load_imported()


def front_pixels(
    mesh: tuple[NDArray[np.float64], NDArray[np.int32]],
    occluder: tuple[NDArray[np.float64], NDArray[np.int32]],
    projections: NDArray[np.float64],
    image: int,
    threshold: float,
    known: Known | None = None,
) -> NDArray[np.int64]:
    """(V, 2) int64: pixels that the mesh covers, and those of them that the occluder stands before.

    ``mesh``, ``occluder``  vertices (n, 3) and faces (m, 3) each; both windings are drawn.
    ``projections``  (V, 3, 4): a view's [x, y, depth] is A p + b with A the first three columns and
                     b the last: x and y in pixels, the depth rising away from the viewer.
    ``image``        pixels a side; what falls outside is clipped.
    ``threshold``    units of depth: the occluder's nearest surface has to be nearer by more.
    ``known``        of the mesh, where something is.

    Raises ValueError as :func:`~simplifier.kernels.coverage.coverage_masks` does.
    """
    points, faces, views = drawable(*mesh, projections, (3, image, image))
    other_points, other_faces, _ = drawable(*occluder, projections, (3, image, image))
    pixels = np.zeros((len(views), 2), dtype=np.int64)
    if len(faces) >= LEAST_FACES and by_contours(len(faces), len(views), image * image):
        # Here, not above: they are built on this file, and small meshes need not load them.
        from simplifier.kernels.contours import draw_by_contours, edge_table
        from simplifier.kernels.front_contours import count_front_by_contours

        table = edge_table(points, faces) if known is None else known.table_of(points, faces)
        if table.pays(image * image):
            flat = np.ascontiguousarray(views[:, :2])
            shown = None if known is None else known.masks_of(points, faces, flat, (image, image))
            if shown is None:
                shown = np.zeros((len(views), image, (image + 63) >> 6), dtype=np.uint64)
                draw_by_contours(table, flat, image, shown)
            count_front_by_contours(
                table, shown, (other_points, other_faces), views, image, threshold, pixels
            )
            return pixels
    run_chunks(
        lambda begin, end: count_front(
            points, faces, other_points, other_faces, views, image, threshold, begin, end, pixels
        ),
        len(views),
        chunks_per_thread=16,
    )
    return pixels


def depth_limits(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    projections: NDArray[np.float64],
    image: int,
    threshold: float,
) -> NDArray[np.float32]:
    """(V, image, image) float32: depths before which an occluder stands in front of a mesh.

    Arguments as of :func:`front_pixels`.  -inf where the mesh does not show.
    """
    points, indices, views = drawable(vertices, faces, projections, (3, image, image))
    limits = np.empty((len(views), image, image), dtype=np.float32)
    run_chunks(
        lambda begin, end: draw_depth_limits(points, indices, views, threshold, begin, end, limits),
        len(views),
        chunks_per_thread=16,
    )
    return limits


@kernel("float64[:, :], int32[:, :], float64[:, :, :], float64, int64, int64, float32[:, :, :]")
def draw_depth_limits(vertices, faces, projections, threshold, begin, end, limits):
    """Fill views ``begin`` to ``end`` of ``limits`` as :func:`depth_limits` says."""
    image = limits.shape[1]
    points, cells = np.empty((vertices.shape[1], 2)), np.empty(vertices.shape[1], np.uint32)
    nearest = np.empty((image, image))
    shown = np.empty((image, (image + 63) >> 6), np.uint64)
    for view in range(begin, end):
        draw_nearest(
            vertices, faces, projections[view], -threshold, points, cells, nearest, shown
        )  # fmt: skip
        for row in range(image):
            for column in range(image):
                depth = nearest[row, column]
                limits[view, row, column] = depth if depth < np.inf else -np.inf


def pixels_before(
    limits: NDArray[np.float32], triangles: NDArray[np.float64], projections: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(V, 2) int64 as :func:`front_pixels`, of a soup (m, 3, 3) and a mesh of which only the
    ``limits`` (V, image, image) are known."""
    image = limits.shape[1]
    corners = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    soup = triangles.reshape(-1, 3)
    points, indices, views = drawable(soup, corners, projections, (3, image, image))
    pixels = np.zeros((len(views), 2), dtype=np.int64)
    run_chunks(
        lambda begin, end: count_before(limits, points, indices, views, begin, end, pixels),
        len(views),
    )
    return pixels


@kernel("float32[:, :, :], float64[:, :], int32[:, :], float64[:, :, :], int64, int64, int64[:, :]")
def count_before(limits, vertices, faces, projections, begin, end, pixels):
    """Fill views ``begin`` to ``end`` of ``pixels`` as :func:`pixels_before` says."""
    image = limits.shape[1]
    points, cells = np.empty((vertices.shape[1], 2)), np.empty(vertices.shape[1], np.uint32)
    nearest = np.empty((image, image))
    shown = np.empty((image, (image + 63) >> 6), np.uint64)
    for view in range(begin, end):
        draw_nearest(vertices, faces, projections[view], 0.0, points, cells, nearest, shown)
        there, before = 0, 0
        for row in range(image):
            for column in range(image):
                limit = limits[view, row, column]
                there += limit > -np.inf
                before += nearest[row, column] < limit
        pixels[view, 0], pixels[view, 1] = there, before


@kernel(
    "float64[:, :], int32[:, :], float64[:, :], int32[:, :], float64[:, :, :], int64, float64, "
    "int64, int64, int64[:, :]"
)
def count_front(
    vertices, faces, other_vertices, other_faces, projections, image, threshold, begin, end, pixels
):
    """Fill views ``begin`` to ``end`` of ``pixels`` (V, 2) int64 as :func:`front_pixels` says.

    ``vertices``, ``other_vertices``  (3, n) float64, ``faces``, ``other_faces`` (m, 3) int32: of
    the mesh and of the occluder.
    """
    most = max(vertices.shape[1], other_vertices.shape[1])
    points, cells = np.empty((most, 2)), np.empty(most, np.uint32)
    limits = np.empty((image, image))
    words = (image + 63) >> 6
    hidden, waiting, seen = (
        np.empty((image, words), np.uint64),
        np.empty((image, words), np.uint64),
        np.empty((image, words), np.uint64),
    )
    for view in range(begin, end):
        hidden[:] = 0
        waiting[:] = ~np.uint64(0)
        seen[:] = 0
        flat, away = projections[view, :2], projections[view, 2]
        draw_nearest(
            other_vertices, other_faces, projections[view], threshold, points, cells, limits, hidden
        )
        project(vertices, flat, image, image, points, cells[: vertices.shape[1]])
        _draw_mesh(vertices, faces, points, cells, away, limits, hidden, waiting, seen)
        pixels[view, 0], pixels[view, 1] = 0, 0
        for row in range(image):
            for word in range(words):
                pixels[view, 0] += np.int64(popcount(seen[row, word]))
                pixels[view, 1] += np.int64(popcount(seen[row, word] & waiting[row, word]))


@inline_kernel
def _depth(vertices, away, vertex):
    return (
        away[0] * vertices[0, vertex]
        + away[1] * vertices[1, vertex]
        + away[2] * vertices[2, vertex]
        + away[3]
    )


@inline_kernel
def _fill_depths(vertices, away, low, middle, high, depths):
    depths[0] = _depth(vertices, away, low)
    depths[1] = _depth(vertices, away, middle)
    depths[2] = _depth(vertices, away, high)


@inline_kernel
def _ends(points, low, middle, high, depths, row, bend):
    """(x, depth, x, depth) where a row enters and leaves a triangle, from left to right.

    A depth lies on the edge, so it is between the corners' however thin the triangle is.
    """
    low_x, low_y = points[low, 0], points[low, 1]
    high_x, high_y = points[high, 0], points[high, 1]
    middle_x, middle_y = points[middle, 0], points[middle, 1]
    share = (row - low_y) / (high_y - low_y)
    x0, z0 = low_x + share * (high_x - low_x), depths[0] + share * (depths[2] - depths[0])
    if row < bend:
        share = (row - low_y) / (middle_y - low_y)
        x1, z1 = low_x + share * (middle_x - low_x), depths[0] + share * (depths[1] - depths[0])
    else:
        share = (row - middle_y) / (high_y - middle_y)
        x1 = middle_x + share * (high_x - middle_x)
        z1 = depths[1] + share * (depths[2] - depths[1])
    if x1 < x0:
        return x1, z1, x0, z0
    return x0, z0, x1, z1


@inline_kernel
def _columns(x0, x1, columns):
    """First column with its centre from x0 on, and the last one with it before x1."""
    first = np.int64(np.ceil(min(max(x0, 0.0), float(columns))))
    return first, np.int64(np.ceil(min(max(x1, 0.0), float(columns)))) - 1


@inline_kernel
def _slope(x0, z0, x1, z1):
    """Depth by column.  Between ends that rounding cannot tell apart either depth is right."""
    return (z1 - z0) / (x1 - x0) if x1 - x0 > _NARROWEST else 0.0


@inline_kernel
def draw_nearest(vertices, faces, projection, threshold, points, cells, nearest, shown):
    """Fill ``nearest`` with the least depths in a view plus the threshold, infinite where no
    triangle is; and set in ``shown``, which is not cleared, where one is.

    ``points``, ``cells``  scratch for as many vertices as there are, or more.
    """
    image = len(nearest)
    nearest[:] = np.inf
    project(vertices, projection[:2], image, image, points, cells[: vertices.shape[1]])
    _draw_limits(vertices, faces, points, cells, projection[2], threshold, nearest, shown)


@inner_kernel
def _draw_limits(vertices, faces, points, cells, away, threshold, limits, hidden):
    """Draw the occluder: its nearest depth plus the threshold, and into ``hidden`` where it is."""
    columns = limits.shape[1]
    depths = np.empty(3)
    for face in range(faces.shape[0]):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        p, q, r = cells[i], cells[j], cells[k]
        if lies_between(p, q, r):
            continue
        bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
        _fill_depths(vertices, away, low, middle, high, depths)
        for row in range(bottom, top):
            x0, z0, x1, z1 = _ends(points, low, middle, high, depths, row, bend)
            first, last = _columns(x0, x1, columns)
            if first <= last:
                slope = _slope(x0, z0, x1, z1)
                start, line = z0 + threshold, limits[row, first : last + 1]
                for place in range(len(line)):
                    line[place] = min(start + (first + place - x0) * slope, line[place])
                set_span(hidden, row, first, last)


@inner_kernel
def _draw_mesh(vertices, faces, points, cells, away, limits, hidden, waiting, seen):
    """Add the mesh's pixels to ``seen``, and take out of ``waiting`` those that are settled.

    What is both seen and waiting in the end lies behind the occluder by more than the threshold.
    """
    depths = np.empty(3)
    for face in range(faces.shape[0]):
        settle_face(
            vertices, points, cells, away, depths, faces[face, 0], faces[face, 1], faces[face, 2],
            limits, hidden, waiting, seen,
        )  # fmt: skip


@inline_kernel
def settle_face(vertices, points, cells, away, depths, i, j, k, limits, hidden, waiting, seen):
    """Draw the triangle of vertices ``i``, ``j`` and ``k``; ``depths`` (3,) is scratch."""
    p, q, r = cells[i], cells[j], cells[k]
    if lies_between(p, q, r):
        return
    box_word, box = box_columns(p, q, r)
    bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
    known = False
    for row in range(bottom, top):
        if box != 0 and (waiting[row, box_word] & box) == 0:
            continue
        if not known:
            _fill_depths(vertices, away, low, middle, high, depths)
            known = True
        x0, z0, x1, z1 = _ends(points, low, middle, high, depths, row, bend)
        first, last = _columns(x0, x1, limits.shape[1])
        if first <= last:
            _settle(x0, z0, x1, z1, row, first, last, limits, hidden, waiting, seen)


@inline_kernel
def _settle(x0, z0, x1, z1, row, first, last, limits, hidden, waiting, seen):
    """Of one row the columns ``first`` to ``last`` of a triangle."""
    slope = _slope(x0, z0, x1, z1)
    for word in range(first >> 6, (last >> 6) + 1):
        begin, end = max(first - 64 * word, 0), min(last - 64 * word, 63)
        span = run_of_ones(begin, end - begin + 1)
        seen[row, word] |= span
        asked = waiting[row, word] & span
        if asked == 0:
            continue
        waiting[row, word] &= ~(span & ~hidden[row, word])
        asked &= hidden[row, word]
        while asked != 0:
            lowest, place = lowest_one(asked)
            asked ^= lowest
            column = 64 * word + place
            if z0 + (column - x0) * slope <= limits[row, column]:
                waiting[row, word] ^= lowest
