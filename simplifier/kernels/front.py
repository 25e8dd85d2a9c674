"""Pixels of a mesh before which an occluder stands, and by more than a threshold.

Centres are covered as in :mod:`simplifier.kernels.coverage`, bit for bit, and nothing is kept of a
mesh but what its pictures still lack.  Pixels where the mesh or the occluder does not show are
settled from the start, any other by the first of the mesh's triangles that is no further behind the
occluder than the threshold.  Most triangles are left out, since their box holds settled pixels
alone; depths are worked out for the others.
"""

from __future__ import annotations

import importlib

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.compiled.waiting import load_imported
from simplifier.kernels.coverage import Known, by_contours, coverage_masks, drawable
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
tenth of a second, and the kernels for it take two seconds to compile.  What is not counted by
contours is listed so many triangles at a time."""


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
    flat = np.ascontiguousarray(views[:, :2])
    shown = None if known is None else known.masks_of(points, faces, flat, (image, image))
    if len(faces) >= LEAST_FACES and by_contours(len(faces), len(views), image * image):
        # Here, not above: they are built on this file, and small meshes need not load them.
        from simplifier.kernels.contours import draw_by_contours, edge_table
        from simplifier.kernels.front_contours import count_front_by_contours

        table = edge_table(points, faces) if known is None else known.table_of(points, faces)
        if table.pays(image * image):
            if shown is None:
                shown = np.zeros((len(views), image, (image + 63) >> 6), dtype=np.uint64)
                draw_by_contours(table, flat, image, shown)
            count_front_by_contours(
                table, shown, (other_points, other_faces), views, image, threshold, pixels
            )
            return pixels
    if shown is None:
        shown = coverage_masks(points.T, faces, flat, image, image, known=known)
    inside_out = _is_inside_out(points, faces)
    run_chunks(
        lambda begin, end: count_front(
            points, faces, inside_out, other_points, other_faces, views, threshold, begin, end,
            shown, pixels,
        ),
        len(views),
        chunks_per_thread=16,
    )  # fmt: skip
    return pixels


def _is_inside_out(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> bool:
    """Whether triangles of a mesh, (3, n) and (m, 3), are wound backwards: its volume tells.  Of
    many it is not asked."""
    if not 0 < len(faces) < LEAST_FACES:
        return False
    a, b, c = (vertices - vertices.mean(axis=1, keepdims=True))[:, faces.T].swapaxes(0, 1)
    return bool((a * np.cross(b, c, axis=0)).sum() < 0.0)


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
    "float64[:, :], int32[:, :], bool, float64[:, :], int32[:, :], float64[:, :, :], float64, "
    "int64, int64, uint64[:, :, :], int64[:, :]"
)
def count_front(
    vertices, faces, inside_out, other_vertices, other_faces, projections, threshold, begin, end,
    shown, pixels,
):  # fmt: skip
    """Fill views ``begin`` to ``end`` of ``pixels`` (V, 2) int64 as :func:`front_pixels` says.

    ``vertices``, ``other_vertices``  (3, n) float64, ``faces``, ``other_faces`` (m, 3) int32: of
                    the mesh and of the occluder.
    ``inside_out``  whether the mesh's triangles are wound backwards; only time depends on it.  Not
                    used where there are :data:`LEAST_FACES` or more.
    ``shown``       (V, image, words) uint64: silhouettes of the mesh.
    """
    image, words = shown.shape[1], shown.shape[2]
    most = max(vertices.shape[1], other_vertices.shape[1])
    points, cells = np.empty((most, 2)), np.empty(most, np.uint32)
    limits, settled = np.empty((image, image)), np.empty((image, words), np.uint64)
    for view in range(begin, end):
        settled[:] = 0
        flat, away = projections[view, :2], projections[view, 2]
        draw_nearest(
            other_vertices, other_faces, projections[view], threshold, points, cells, limits,
            settled,
        )  # fmt: skip
        pixels[view, 0] = settle_others(settled, shown[view])
        project(vertices, flat, image, image, points, cells[: vertices.shape[1]])
        _settle_mesh(vertices, faces, points, cells, away, inside_out, limits, settled)
        pixels[view, 1] = count_waiting(settled)


@inline_kernel
def settle_others(settled, shown):
    """Turn pixels where the occluder shows into those that are settled, since the mesh or the
    occluder does not show there; count those where the mesh does."""
    there = np.uint64(0)
    for row in range(len(shown)):
        for word in range(shown.shape[1]):
            there += popcount(shown[row, word])
            settled[row, word] = ~(settled[row, word] & shown[row, word])
    return np.int64(there)


@inline_kernel
def count_waiting(settled):
    """The number of pixels that nothing has settled: the occluder stands before them."""
    waiting = np.uint64(0)
    for row in range(len(settled)):
        for word in range(settled.shape[1]):
            waiting += popcount(~settled[row, word])
    return np.int64(waiting)


@inline_kernel
def _corner(vertices, points, away, vertex):
    """x, y and depth of a vertex in a picture."""
    depth = (
        away[0] * vertices[0, vertex]
        + away[1] * vertices[1, vertex]
        + away[2] * vertices[2, vertex]
        + away[3]
    )
    return points[vertex, 0], points[vertex, 1], depth


@inline_kernel
def empty_spans(image):
    """Scratch for :func:`settle_face`, of each row of a triangle: where it begins, in x and in
    depth, and its slope, (3, rows) float64; its first column and the last, (2, rows) int64."""
    return np.empty((3, image)), np.empty((2, image), np.int64)


@inline_kernel
def _fill_spans(low, middle, high, bottom, bend, top, spans):
    """Fill the rows of a triangle; ``low`` to ``high`` are x, y and depth of its corners, and
    ``bottom`` to ``top`` as :func:`~simplifier.kernels.faces.rows_of` gives them."""
    _fill_between(low, high, low, middle, bottom, bend, spans)
    _fill_between(low, high, middle, high, bend, top, spans)


@inline_kernel
def _fill_between(a, b, c, d, begin, end, spans):
    """Of the rows ``begin`` to ``end``, between an edge from ``a`` to ``b`` and one from ``c`` to
    ``d``: a loop that divides for several rows at once.

    A depth lies on the edge, so it is between the corners' however thin the triangle is.
    """
    starts, ends = spans
    columns = float(starts.shape[1])
    ax, ay, az = a
    bx, by, bz = b
    cx, cy, cz = c
    dx, dy, dz = d
    for row in range(begin, end):
        share = (row - ay) / (by - ay)
        x0, z0 = ax + share * (bx - ax), az + share * (bz - az)
        share = (row - cy) / (dy - cy)
        x1, z1 = cx + share * (dx - cx), cz + share * (dz - cz)
        swapped = x1 < x0
        left, right = (x1 if swapped else x0), (x0 if swapped else x1)
        start, stop = (z1 if swapped else z0), (z0 if swapped else z1)
        width, place = right - left, np.uint64(row)
        starts[0, place], starts[1, place] = left, start
        # Between ends that rounding cannot tell apart either depth is right.
        starts[2, place] = (stop - start) / width if width > _NARROWEST else 0.0
        ends[0, place] = np.int64(np.ceil(min(max(left, 0.0), columns)))
        ends[1, place] = np.int64(np.ceil(min(max(right, 0.0), columns))) - 1


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
    spans = empty_spans(len(limits))
    starts, ends = spans
    for face in range(len(faces)):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        p, q, r = cells[i], cells[j], cells[k]
        if lies_between(p, q, r):
            continue
        bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
        _fill_spans(
            _corner(vertices, points, away, low), _corner(vertices, points, away, middle),
            _corner(vertices, points, away, high), bottom, bend, top, spans,
        )  # fmt: skip
        for row in range(bottom, top):
            first, last = ends[0, row], ends[1, row]
            if first <= last:
                left, start, slope = starts[0, row], starts[1, row] + threshold, starts[2, row]
                line = limits[row, first : last + 1]
                for place in range(len(line)):
                    line[place] = min(start + (first + place - left) * slope, line[place])
                set_span(hidden, row, first, last)


@inner_kernel
def _settle_mesh(vertices, faces, points, cells, away, inside_out, limits, settled):
    """Add to ``settled`` what the mesh settles.

    What faces the viewer lies before what faces away and leaves little to it, so that comes last.
    Of many triangles the corners would have to be fetched to tell, which takes longer.
    """
    spans, few = empty_spans(len(limits)), len(faces) < LEAST_FACES
    listed = np.empty(min(len(faces), LEAST_FACES), np.int32)
    for begin in range(0, len(faces), LEAST_FACES):
        facing, others = 0, len(listed)
        for face in range(begin, min(begin + LEAST_FACES, len(faces))):
            i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
            if lies_between(cells[i], cells[j], cells[k]):
                continue
            if few and _is_clockwise(points, i, j, k) == inside_out:
                others -= 1
                listed[others] = face
            else:
                listed[facing] = face
                facing += 1
        for place in range(facing + len(listed) - others):
            face = listed[place if place < facing else place - facing + others]
            settle_face(
                vertices, points, cells, away, faces[face, 0], faces[face, 1], faces[face, 2],
                limits, spans, settled,
            )  # fmt: skip


@inline_kernel
def _is_clockwise(points, i, j, k):
    """Whether a triangle is in a picture whose y rises, where it faces the viewer if it is wound
    outward: the depth rises away from him, so that x, y and depth are left-handed."""
    x, y = points[i, 0], points[i, 1]
    return (points[j, 0] - x) * (points[k, 1] - y) < (points[j, 1] - y) * (points[k, 0] - x)


@inline_kernel
def settle_face(vertices, points, cells, away, i, j, k, limits, spans, settled):
    """Add to ``settled`` the pixels in which the triangle of vertices ``i``, ``j`` and ``k``, which
    does not lie between pixels, is not beyond the limit; ``spans`` is scratch."""
    p, q, r = cells[i], cells[j], cells[k]
    bottom, bend, top, low, middle, high = rows_of(p, q, r, i, j, k)
    word, box = box_columns(p, q, r)
    if box != 0:
        waiting = np.uint64(0)
        for row in range(bottom, top):
            waiting |= ~settled[row, word]
        if waiting & box == 0:
            return
    _fill_spans(
        _corner(vertices, points, away, low), _corner(vertices, points, away, middle),
        _corner(vertices, points, away, high), bottom, bend, top, spans,
    )  # fmt: skip
    starts, ends = spans
    for row in range(bottom, top):
        first, last = ends[0, row], ends[1, row]
        if first > last:
            continue
        left, start, slope = starts[0, row], starts[1, row], starts[2, row]
        for word in range(first >> 6, (last >> 6) + 1):
            begin, end = max(first, 64 * word), min(last, 64 * word + 63) + 1
            if ~settled[row, word] & run_of_ones(begin & 63, end - begin) == 0:
                continue
            line, reached = limits[row, begin:end], np.uint64(0)
            for place in range(len(line)):
                depth = start + (begin + place - left) * slope
                reached |= np.uint64(depth <= line[place]) << np.uint64(place)
            settled[row, word] |= reached << np.uint64(begin & 63)
