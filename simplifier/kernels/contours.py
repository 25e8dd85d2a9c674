"""Silhouettes of a fine mesh by its contour, bit for bit what drawing each triangle gives.

In a view the triangles that face the viewer cover a pixel as often as their directed edges cross
its row to the left of it, counted by direction.  Where two such triangles share an edge its two
crossings are the same number and cancel, so only edges between triangles that face differently
count (the contour; Appel 1967), and open ones.  A fine mesh has a hundred triangles for each.

A closed mesh is covered by what faces the viewer where it is covered at all; an open one also by
what faces away, counted likewise.  Triangles so near to edge-on that rounding could turn them are
drawn one by one.  Where a contour's vertex is so near to a pixel's centre that rounding could take
its two edges for each other, the view is drawn triangle by triangle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.coverage import MaskArray, draw_faces, lies_between, project
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent

_OPEN_SHARE = 0.125  # of the edges: more of them cost what they save
_SCRATCH = 1 << 24  # bytes of counts a thread
_VIEWS = 64  # at a time: a bit each
_EDGE_ON = 1e-4  # of the square of the longest edge: below that, twice the area counts as none
_NEAR = 1e-5  # pixels: rounding moves a crossing by 1e-7 at most where a triangle ends
_FAR = 1e4  # pixels: up to there it does


@dataclass(frozen=True)
class EdgeTable:
    """A mesh with its edges.

    ``vertices``  (3, n) float64, no two with the same bits; ``faces`` (m, 3) int32.
    ``planes``  (m, 4) float32 as :func:`fill_planes` fills them.
    ``edges``   (e, 4) int32: from, to, the triangle that it runs along, and the one on the other
                side, along which it runs backwards; where there is none the number of triangles.
    ``open``    how many have none.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    planes: NDArray[np.float32]
    edges: NDArray[np.int32]
    open: int

    @property
    def worth_it(self) -> bool:
        """Whether so few are open that counting them pays."""
        return self.open <= _OPEN_SHARE * len(self.edges)

    @property
    def sides(self) -> int:
        """Ways to face that have to be drawn: of a closed mesh either shows all."""
        return 2 if self.open else 1


def edge_table(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> EdgeTable:
    """Of ``vertices`` (3, n) and ``faces`` (m, 3); vertices at the same place become one."""
    points, joined = _joined(vertices, faces)
    planes = np.empty((len(faces), 4), dtype=np.float32)
    fill_planes(points, joined, planes)
    edges, alone = _edges_of(joined)
    return EdgeTable(points, joined, planes, edges, alone)


def _joined(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Of vertices with the same bits the first one alone, in the order that they had."""
    first = _first_of_each(vertices)
    kept = np.zeros(len(first), dtype=np.bool_)
    kept[first] = True
    if kept.all():
        return vertices, faces
    places = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    return np.ascontiguousarray(vertices[:, kept]), places[first][faces]


def _edges_of(faces: NDArray[np.int32]) -> tuple[NDArray[np.int32], int]:
    """Edges as :class:`EdgeTable` has them, and how many have one triangle: the last ones."""
    count = np.int32(len(faces))
    start = faces.T.ravel()
    end = faces[:, [1, 2, 0]].T.ravel()
    keys = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    order = np.argsort(keys)
    keys = keys[order]
    same = keys[1:] == keys[:-1]
    del keys
    rising = (start < end)[order]
    # Two triangles, which run along it in opposite directions, and no third.
    pairs = same & (rising[1:] != rising[:-1])
    pairs[1:] &= ~same[:-1]
    pairs[:-1] &= ~same[1:]
    first = np.flatnonzero(pairs)
    alone = np.ones(len(order), dtype=np.bool_)
    alone[first] = alone[first + 1] = False
    there = np.concatenate([order[first], order[alone]])
    edges = np.empty((len(there), 4), dtype=np.int32)
    edges[:, 0], edges[:, 1], edges[:, 2] = start[there], end[there], there % count
    edges[: len(first), 3] = order[first + 1] % count
    edges[len(first) :, 3] = count
    return edges, len(there) - len(first)


def _first_of_each(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n,) for each vertex the first one with the same bits."""
    x, y, z = np.ascontiguousarray(vertices).view(np.uint64)
    mixed = x * np.uint64(0x9E3779B97F4A7C15)
    mixed = ((mixed ^ (mixed >> np.uint64(29))) + y) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = ((mixed ^ (mixed >> np.uint64(31))) + z) * np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(30)
    _, first, place = np.unique(mixed, return_index=True, return_inverse=True)
    joined = first[place]
    if not np.array_equal(vertices[:, joined], vertices):  # two places that are mixed alike
        joined = np.arange(vertices.shape[1])
    return np.asarray(joined, dtype=np.int64)


def draw_by_contours(
    table: EdgeTable,
    views: NDArray[np.float64],
    columns: int,
    masks: MaskArray,
    tell: TellShare = silent,
) -> None:
    """Fill ``masks`` (V, rows, words), which are 0, as
    :func:`~simplifier.kernels.coverage.draw_views` does."""
    axes = sight_axes(views)
    batch = _SCRATCH // (4 * table.sides * (columns + 1) * masks.shape[1])
    batch = min(max(batch, 1), _VIEWS)

    def draw(begin: int, end: int) -> None:
        draw_contours(
            table.vertices, table.faces, table.edges, table.planes, axes, views, columns,
            table.sides, batch, begin * batch, min(end * batch, len(views)), masks,
        )  # fmt: skip

    run_chunks(draw, -(-len(views) // batch), chunks_per_thread=8, tell=tell)


def sight_axes(views: NDArray[np.float64]) -> NDArray[np.float32]:
    """(V, 4): the normal of each view's plane, and the scale of its areas; ``views`` (V, 2, 4)."""
    axes = np.empty((len(views), 4), dtype=np.float32)
    axes[:, :3] = np.cross(views[:, 0, :3], views[:, 1, :3])
    axes[:, 3] = np.linalg.norm(views[:, :, :3], axis=2).prod(axis=1)
    return axes


@kernel("float64[:, :], int32[:, :], float32[:, :]")
def fill_planes(vertices, faces, planes):
    """Fill ``planes`` (m, 4): a normal as long as twice the triangle's area, and the least length
    along a line of sight at which the triangle is not edge-on."""
    for face in range(len(faces)):
        i, j, k = faces[face, 0], faces[face, 1], faces[face, 2]
        ax, bx = vertices[0, j] - vertices[0, i], vertices[0, k] - vertices[0, i]
        ay, by = vertices[1, j] - vertices[1, i], vertices[1, k] - vertices[1, i]
        az, bz = vertices[2, j] - vertices[2, i], vertices[2, k] - vertices[2, i]
        cx, cy, cz = bx - ax, by - ay, bz - az
        planes[face, 0] = ay * bz - az * by
        planes[face, 1] = az * bx - ax * bz
        planes[face, 2] = ax * by - ay * bx
        longest = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
        planes[face, 3] = _EDGE_ON * max(longest, cx * cx + cy * cy + cz * cz)


@inner_kernel
def fill_sides(planes, axes, front, back):
    """Fill bits of views: of those in which a triangle is wound one way, and of the other way."""
    one, none = np.uint64(1), np.uint64(0)
    lines = np.empty((4, len(axes)), np.float32)
    for view in range(len(axes)):
        for axis in range(4):
            lines[axis, view] = axes[view, axis]
    for face in range(len(planes)):
        a, b, c, least = planes[face, 0], planes[face, 1], planes[face, 2], planes[face, 3]
        here, there = none, none
        for view in range(len(axes)):
            area = a * lines[0, view] + b * lines[1, view] + c * lines[2, view]
            bound = least * lines[3, view]
            here |= (one if area > bound else none) << np.uint64(view)
            there |= (one if area < -bound else none) << np.uint64(view)
        front[face], back[face] = here, there


@inline_kernel
def _along(projections, view, axis, x, y, z):
    """A coordinate of the image, bit for bit as :func:`~simplifier.kernels.coverage.project`."""
    return (
        projections[view, axis, 0] * x
        + projections[view, axis, 1] * y
        + projections[view, axis, 2] * z
        + (projections[view, axis, 3] - 0.5)
    )


@inline_kernel
def _cell(value, count):
    """The first pixel with its centre at or past a coordinate."""
    return np.int64(np.ceil(min(max(value, 0.0), float(count))))


@inline_kernel
def _on_centre(x, y):
    """Whether rounding matters to the crossings that end here."""
    near = (abs(x - np.rint(x)) < _NEAR) & (abs(y - np.rint(y)) < _NEAR)
    return near | (max(abs(x), abs(y)) > _FAR)


@inner_kernel
def count_edges(vertices, edges, bits, projections, sign, side, counts, unsure):
    """Count where the contour of the triangles that have a view's bit crosses rows, in each view.

    ``counts`` (V, sides, columns + 1, rows) int32 is added to, ``unsure`` (V,) set where rounding
    matters.
    """
    columns, rows = counts.shape[2] - 1, counts.shape[3]
    for place in range(len(edges)):
        own = bits[edges[place, 2]]
        waiting = own ^ bits[edges[place, 3]]
        if waiting == 0:
            continue
        i, j = edges[place, 0], edges[place, 1]
        ax, ay, az = vertices[0, i], vertices[1, i], vertices[2, i]
        bx, by, bz = vertices[0, j], vertices[1, j], vertices[2, j]
        while waiting != 0:
            lowest, view = lowest_one(waiting)
            waiting ^= lowest
            low_y = _along(projections, view, 1, ax, ay, az)
            high_y = _along(projections, view, 1, bx, by, bz)
            begin, end = _cell(low_y, rows), _cell(high_y, rows)
            if begin == end:
                continue
            low_x = _along(projections, view, 0, ax, ay, az)
            high_x = _along(projections, view, 0, bx, by, bz)
            unsure[view] |= _on_centre(low_x, low_y) | _on_centre(high_x, high_y)
            turned = np.int32(sign) if own & lowest != 0 else np.int32(-sign)
            if begin < end:
                turned = -turned
            else:
                begin, end = end, begin
                low_x, low_y, high_x, high_y = high_x, high_y, low_x, low_y
            for row in range(begin, end):
                x = low_x + (row - low_y) / (high_y - low_y) * (high_x - low_x)
                counts[view, side, _cell(x, columns), row] += turned


@inner_kernel
def cover(counts, columns, mask):
    """Set the pixels of which a sum of crossings, from the left, is more than none.

    Leaves ``counts`` 0 as it came: it is at hand here, and clearing it later takes as long.
    """
    rows = mask.shape[0]
    inside, bits = np.zeros(rows, np.int32), np.empty(rows, np.uint32)
    for half in range((columns + 31) // 32):
        bits[:] = 0
        for place in range(min(columns - 32 * half, 32)):
            line = counts[32 * half + place]
            for row in range(rows):
                inside[row] += line[row]
                line[row] = 0
                bits[row] |= np.uint32(inside[row] > 0) << np.uint32(place)
        for row in range(rows):
            mask[row, half >> 1] |= np.uint64(bits[row]) << np.uint64(32 * (half & 1))
    counts[columns] = 0  # right of the picture


@inner_kernel
def _draw_edge_on(vertices, faces, front, back, projections, columns, masks):
    """Draw the triangles that have neither bit of a view."""
    rows, views = masks.shape[1], len(projections)
    every = ~np.uint64(0) >> np.uint64(64 - views)
    corners, points, cells = np.empty((3, 3)), np.empty((3, 2)), np.empty(3, np.uint32)
    own = np.empty((1, 3), np.int32)
    own[0, 0], own[0, 1], own[0, 2] = 0, 1, 2
    for face in range(len(faces)):
        waiting = ~(front[face] | back[face]) & every
        if waiting != 0:
            for corner in range(3):
                for axis in range(3):
                    corners[axis, corner] = vertices[axis, faces[face, corner]]
        while waiting != 0:
            lowest, view = lowest_one(waiting)
            waiting ^= lowest
            project(corners, projections[view], rows, columns, points, cells)
            if not lies_between(cells[0], cells[1], cells[2]):
                draw_faces(points, cells, own, columns, masks[view])


@kernel(
    "float64[:, :], int32[:, :], int32[:, :], float32[:, :], float32[:, :], float64[:, :, :], "
    "int64, int64, int64, int64, int64, uint64[:, :, :]"
)
def draw_contours(
    vertices, faces, edges, planes, axes, projections, columns, sides, batch, begin, end, masks
):
    """Set the covered bits of ``masks[begin:end]``, ``batch`` views at a time, at most 64.

    ``edges``, ``planes`` and ``sides`` are those of an :class:`EdgeTable`, ``axes`` (V, 4) those of
    :func:`sight_axes`.
    """
    front, back = np.zeros(len(faces) + 1, np.uint64), np.zeros(len(faces) + 1, np.uint64)
    counts = np.zeros((batch, sides, columns + 1, masks.shape[1]), np.int32)
    unsure = np.empty(batch, np.bool_)
    for first in range(begin, end, batch):
        last = min(first + batch, end)
        fill_sides(planes, axes[first:last], front, back)
        unsure[:] = False
        draw_batch(
            vertices, faces, edges, front, back, projections[first:last], columns, counts, unsure,
            masks[first:last],
        )  # fmt: skip


@inner_kernel
def draw_batch(vertices, faces, edges, front, back, views, columns, counts, unsure, masks):
    """Set the covered bits of ``masks``, whose views ``front`` and ``back`` tell of, bit by bit.

    ``counts`` (V, sides, columns + 1, rows) int32 is 0 before and after, ``unsure`` (V,) False.
    """
    sides, rows = counts.shape[1], masks.shape[1]
    count_edges(vertices, edges, front, views, 1, 0, counts, unsure)
    if sides == 2:
        count_edges(vertices, edges, back, views, -1, 1, counts, unsure)
    for view in range(len(views)):
        for side in range(sides):
            cover(counts[view, side], columns, masks[view])
        if unsure[view]:
            masks[view] = 0
    _draw_edge_on(vertices, faces, front, back, views, columns, masks)
    if unsure.any():
        points = np.empty((vertices.shape[1], 2))
        cells = np.empty(vertices.shape[1], np.uint32)
        for view in range(len(views)):
            if unsure[view]:
                project(vertices, views[view], rows, columns, points, cells)
                draw_faces(points, cells, faces, columns, masks[view])
