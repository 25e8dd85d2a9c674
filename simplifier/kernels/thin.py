"""Let one vertex stand for all in its cell of a lattice; keep the triangles with three corners.

The first or the outermost of them stands where it was, or all meet at their mean.

Cracks along T-junctions: a vertex on an edge that the triangle beyond does not have.

The surface is closed there as long as nothing moves.  Where vertices move within their cells the
edge and the vertex part, and a slit opens; a flat triangle between them, moved along with both,
fills it.  The walk along an edge is that of Amanatides and Woo, "A Fast Voxel Traversal Algorithm
for Ray Tracing" (1987).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.edges import list_edges
from simplifier.kernels.threads import run_chunks


@inline_kernel
def _within(points, index, low, step):
    """A point in units of a cell."""
    return (
        (points[index, 0] - low[0]) / step,
        (points[index, 1] - low[1]) / step,
        (points[index, 2] - low[2]) / step,
    )


@kernel(
    "float64[:, :], float64[:], float64, float64[:], bool, int32[:, :, :], float64[:, :], "
    "float64[:], int32[:]"
)
def gather_points(vertices, low, step, middle, outermost, numbers, points, reach, chosen):
    """Gather one of ``vertices`` (n, 3) in each cell into ``points`` (n, 3); their number.

    That is the first, or with ``outermost`` the one furthest from ``middle`` (3,), in cells.
    Cells are cubes of edge ``step`` from the corner ``low`` (3,) on; ``numbers`` (cx, cy, cz)
    int32, zeros, becomes one more than the point of each cell, so that memory of cells without one
    stays untouched.  ``reach`` (n,) float64 becomes the square of how far off each point is, and
    ``chosen`` (n,) int32 tells the point of each vertex.
    """
    count = 0
    for index in range(len(vertices)):
        x, y, z = _within(vertices, index, low, step)
        away = (x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (z - middle[2]) ** 2
        x, y, z = np.int64(x), np.int64(y), np.int64(z)
        is_new = numbers[x, y, z] == 0
        if is_new:
            count += 1
            numbers[x, y, z] = count
        place = numbers[x, y, z] - 1
        chosen[index] = place
        if is_new or (outermost and away > reach[place]):
            reach[place] = away
            for axis in range(3):
                points[place, axis] = vertices[index, axis]
    return count


Cells = tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]]

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_BLOCK = 1024  # vertices whose cells are found before any is looked up


def sum_up_cells(
    vertices: NDArray[np.float64],
    low: NDArray[np.float64],
    unit: float,
    size: float,
    shape: NDArray[np.int64],
    steps: NDArray[np.int64],
    border: NDArray[np.bool_] | None = None,
) -> Cells:
    """What is in each cell of a lattice: ``place`` (n,) int32, the number of each vertex's cell,
    ``counts`` (k,) int64 of the vertices that stand for it, and ``sums`` (k, 3) float64 of these,
    added up in their order.

    ``vertices`` (n, 3) are measured from ``low`` (3,) in a ``unit``.  A cell is a cube of ``size``
    of these, and there are ``shape`` (3,) along the axes; what is past the last belongs to it.
    All of a cell's vertices stand for it, or those on a ``border`` (n,) bool where it has any: the
    mean of all would draw an open sheet in, by half a cell all around.
    Cells with a vertex are numbered from 0 on in the order of their indices times ``steps`` (3,),
    added up, which tell them apart.
    """
    most = min(len(vertices), int(shape.prod()))
    bits = max(int(2 * most).bit_length(), 1)
    names, numbers = np.full(1 << bits, -1, dtype=np.int64), np.empty(1 << bits, dtype=np.int32)
    chosen, keys = np.empty(len(vertices), dtype=np.int32), np.empty(most, dtype=np.int64)
    counts, sums = np.zeros(most, dtype=np.int64), np.zeros((most, 3))
    open_cells = np.zeros(most, dtype=np.bool_)
    ends = np.ascontiguousarray(shape - 1)
    if border is None:
        border = np.zeros(len(vertices), dtype=np.bool_)
    count = gather_cells(
        vertices, border, low, unit, size, ends, steps, names, numbers, chosen, keys, open_cells,
        counts, sums
    )  # fmt: skip
    order = np.argsort(keys[:count])
    ranks = np.empty(count, dtype=np.int32)
    ranks[order] = np.arange(count, dtype=np.int32)
    return ranks[chosen], counts[order], sums[order]


@kernel(
    "float64[:, :], bool[:], float64[:], float64, float64, int64[:], int64[:], int64[:], int32[:], "
    "int32[:], int64[:], bool[:], int64[:], float64[:, :]"
)
def gather_cells(
    vertices, border, low, unit, size, ends, steps, names, numbers, chosen, keys, open_cells,
    counts, sums
):  # fmt: skip
    """Add up the ``vertices`` (n, 3) of each cell, as :func:`sum_up_cells` says; return how many
    cells there are.

    ``ends``    (3,) int64 the last cell along each axis.
    ``names``   (2**b,) int64 with -1 in each, ``numbers`` int32: a table of what is found, more
                than twice as long as there may be cells.
    ``chosen``  (n,) int32: the number of each vertex's cell, in the order in which they come.
    ``keys``, ``counts``  int64, ``sums``  (…, 3) float64, ``open_cells``  bool, whether a vertex
                of the border is there, zeros: of each cell.
    """
    count, mask = 0, np.int64(len(names) - 1)
    places, cells = np.empty((3, _BLOCK)), np.empty(_BLOCK, np.int64)
    for first in range(0, len(vertices), _BLOCK):
        there = min(_BLOCK, len(vertices) - first)
        for one in range(there):  # apart from the table, so that it divides eight at a time
            x = (vertices[first + one, 0] - low[0]) / unit
            y = (vertices[first + one, 1] - low[1]) / unit
            z = (vertices[first + one, 2] - low[2]) / unit
            places[0, one], places[1, one], places[2, one] = x, y, z
            key = min(max(np.int64(x / size), 0), ends[0]) * steps[0]
            key += min(max(np.int64(y / size), 0), ends[1]) * steps[1]
            key += min(max(np.int64(z / size), 0), ends[2]) * steps[2]
            cells[one] = key
        for one in range(there):
            key = cells[one]
            slot = np.int64((np.uint64(key) * _GOLDEN) >> np.uint64(32)) & mask
            while names[slot] != key and names[slot] >= 0:
                slot = (slot + 1) & mask
            if names[slot] < 0:
                names[slot] = key
                numbers[slot] = count
                keys[count] = key
                count += 1
            number = np.int64(numbers[slot])
            chosen[first + one] = number
            if border[first + one] != open_cells[number]:
                if open_cells[number]:
                    continue
                open_cells[number] = True
                counts[number] = 0
                for axis in range(3):
                    sums[number, axis] = 0.0
            counts[number] += 1
            for axis in range(3):
                sums[number, axis] += places[axis, one]
    return count


def whole_faces(faces: NDArray[np.int32], chosen: NDArray[np.int32]) -> NDArray[np.int32]:
    """(k, 3) int32 the ``faces`` (m, 3) whose vertices move to three places, by these, in order.

    Vertex i moves to ``chosen[i]``.
    """
    kept = np.empty((len(faces), 3), dtype=np.int32)
    parts: dict[int, NDArray[np.int32]] = {}

    def keep(begin: int, end: int) -> None:
        some = kept[begin:end]
        parts[begin] = some[: keep_whole(faces[begin:end], chosen, some)]

    run_chunks(keep, len(faces), least=_LEAST_FACES)
    return np.concatenate([kept[:0], *(parts[begin] for begin in sorted(parts))])


_LEAST_FACES = 1 << 16  # fewer are not worth a hand-over to another thread


@kernel("int32[:, :], int32[:], int32[:, :]")
def keep_whole(faces, chosen, kept):
    """Write the ``faces`` (m, 3) int32 whose chosen corners differ to ``kept``; their number."""
    count = 0
    for face in range(len(faces)):
        a, b, c = chosen[faces[face, 0]], chosen[faces[face, 1]], chosen[faces[face, 2]]
        if a != b and b != c and c != a:
            kept[count, 0], kept[count, 1], kept[count, 2] = a, b, c
            count += 1
    return count


_ON_EDGE = 1e-3  # cells; exporters round coordinates, and a slit as narrow as this is none


def border_places(
    faces: NDArray[np.int32], count: int, *, sides_as_one: bool = False
) -> NDArray[np.bool_]:
    """(count,) bool: the ends of edges that one face alone has.

    ``faces``         (m, 3), of so many vertices.
    ``sides_as_one``  whether faces with the same three vertices are one, as both sides of a sheet.
    """
    border = np.zeros(count, dtype=np.bool_)
    mark_border(faces, np.zeros(count + 2, dtype=np.int32), sides_as_one, border)
    return border


def crack_triangles(
    points: NDArray[np.float64],
    low: NDArray[np.float64],
    step: float,
    faces: NDArray[np.int32],
    chosen: NDArray[np.int32],
    numbers: NDArray[np.int32],
    border: NDArray[np.bool_],
) -> NDArray[np.int32]:
    """(k, 3) flat triangles over the T-junctions that moving opens; none where there are none.

    ``points`` (n, 3) lie in cells of edge ``step`` from the corner ``low`` (3,) on; ``faces``
    (m, 3).  Vertex i moves to the place ``chosen[i]``, the same for all in a cell.  ``numbers``
    (cx, cy, cz) holds one more than the place of each cell, and 0 where no vertex lies; ``border``
    (places,) are the :func:`border_places` of what is left then.  Edges within two neighbouring
    cells open none, nor does a vertex in the cell of an end, nor an edge with an end that is on no
    border: where there is none at all, neither are there such triangles, and looking for them takes
    time and room.
    """
    edges = _edges_passing(np.ascontiguousarray(faces), points, low, step, border[chosen])
    if len(edges) == 0:
        return np.empty((0, 3), dtype=np.int32)
    ends = ((points[edges] - low) / step).astype(np.int32)
    passed = np.abs(ends[:, 0] - ends[:, 1]).sum(axis=1) - 1  # cells between those of the ends
    starts = np.zeros(len(border) + 2, dtype=np.int32)
    held = np.empty(len(points), dtype=np.int32)
    sort_by_place(chosen, starts, held)
    parts: dict[int, NDArray[np.int32]] = {}

    def find(begin: int, end: int) -> None:
        some = edges[begin:end]
        triangles = np.empty((int(passed[begin:end].sum()), 3), dtype=np.int32)
        count = t_junctions(points, low, step, some, numbers, starts, held, _ON_EDGE, triangles)
        parts[begin] = triangles[:count]

    run_chunks(find, len(edges), least=_LEAST_EDGES)
    return np.concatenate([parts[begin] for begin in sorted(parts)])


_LEAST_EDGES = 1024  # fewer are not worth a hand-over to another thread


def _edges_passing(
    faces: NDArray[np.int32],
    points: NDArray[np.float64],
    low: NDArray[np.float64],
    step: float,
    ends: NDArray[np.bool_],
) -> NDArray[np.int32]:
    """(k, 2) the edges that pass a cell between their ends', each once, in order; ``ends`` (n,)
    tells of each vertex whether it may be one."""
    names = np.empty(faces.size, np.uint64)  # of which only what is written takes memory
    count = passing_edges(faces, points, low, step, ends, names)
    # Sorted, not by np.unique: that goes by way of a table, which takes ten times as long.
    names = np.sort(names[:count])
    another = np.ones(count, dtype=np.bool_)
    another[1:] = names[1:] != names[:-1]
    names = names[another]
    return np.stack([names >> np.uint64(32), names & np.uint64(0xFFFFFFFF)], 1).astype(np.int32)


@kernel("int32[:, :], int32[:], bool, bool[:]")
def mark_border(faces, starts, sides_as_one, border):
    """Set ``border`` (n,) bool as :func:`border_places` says; ``faces`` (m, 3) int32.

    ``starts``  (n + 2,) int32, zeros.
    """
    listed = list_edges(faces, starts)
    # Of the edge to each vertex: its face, counted from 1, -1 where it has several.
    owners = np.zeros(len(border), np.int32)
    for place in range(len(border)):
        begin, end = starts[place], starts[place + 1]
        for edge in range(begin, end):
            other, face = listed[edge, 0], listed[edge, 1]
            if face < 0:
                face = ~face
            owner = face + 1
            if sides_as_one:  # told by its third vertex
                owner = faces[face, 0] + faces[face, 1] + faces[face, 2] - place - other + 1
            owners[other] = owner if owners[other] in (0, owner) else -1
        for edge in range(begin, end):
            if owners[listed[edge, 0]] > 0:
                border[place] = True
                border[listed[edge, 0]] = True
        for edge in range(begin, end):
            owners[listed[edge, 0]] = 0


@kernel("int32[:], int32[:], int32[:]")
def sort_by_place(chosen, starts, held):
    """Write 0 .. n - 1 to ``held`` (n,) int32, those of a place together and in order.

    ``chosen``  (n,) int32 the place of each.
    ``starts``  (places + 2,) int32 zeros; place p then holds ``held[starts[p] : starts[p + 1]]``.
    """
    for index in range(len(chosen)):
        starts[chosen[index] + 2] += 1
    for place in range(2, len(starts)):
        starts[place] += starts[place - 1]
    for index in range(len(chosen)):
        held[starts[chosen[index] + 1]] = index
        starts[chosen[index] + 1] += 1


@kernel("int32[:, :], float64[:, :], float64[:], float64, bool[:], uint64[:]")
def passing_edges(faces, points, low, step, ends, names):
    """Write the edges that pass a cell between their ends'; returns their number.

    ``faces``  (m, 3) int32; ``points`` (n, 3) in cells of edge ``step`` from ``low`` on, and
               ``ends`` (n,) bool whether an edge may end there.
    ``names``  (3 m,) uint64: the lower end times 2**32, and the other one.  An edge comes once a
               face.
    """
    count = 0
    for face in range(len(faces)):
        for k in range(3):
            a, b = faces[face, k], faces[face, (k + 1) % 3]
            if not (ends[a] and ends[b]):
                continue
            x, y, z = _within(points, a, low, step)
            u, v, w = _within(points, b, low, step)
            way = abs(np.int64(x) - np.int64(u)) + abs(np.int64(y) - np.int64(v))
            way += abs(np.int64(z) - np.int64(w))
            if way >= 2:
                names[count] = np.uint64(min(a, b)) << np.uint64(32) | np.uint64(max(a, b))
                count += 1
    return count


@kernel(
    "float64[:, :], float64[:], float64, int32[:, :], int32[:, :, :], int32[:], int32[:], float64, "
    "int32[:, :]"
)
def t_junctions(points, low, step, edges, numbers, starts, held, tolerance, triangles):
    """Write flat triangles between edges and the vertices on them; returns how many.

    ``points``     (n, 3) float64 in cells of edge ``step`` from ``low`` (3,) on.
    ``edges``      (k, 2) int32: pairs of points.
    ``numbers``    (cx, cy, cz) int32: one more than the place that the points of a cell move to; 0
                   where there are none.
    ``starts``, ``held``  (places + 2,) and (n,) int32: place p is that of the points
                   ``held[starts[p] : starts[p + 1]]``.
    ``tolerance``  cells; who is as near to the edge lies on it.
    ``triangles``  (rows, 3) int32, a row for each cell that an edge passes between its ends.

    Of a cell that an edge passes, its ends' cells apart, one vertex is taken, the first of those
    held.  From one to the next along the edge, and on to its end, the triangles fill what lies
    between the edge and the chain of these vertices.
    """
    count = 0
    place = np.empty(3, np.int64)
    left = np.empty(3, np.int64)
    ahead = np.empty(3, np.int64)
    following = np.empty(3)
    pace = np.empty(3)
    for edge in range(len(edges)):
        a, b = edges[edge, 0], edges[edge, 1]
        begin, end = _within(points, a, low, step), _within(points, b, low, step)
        squared = 0.0
        for k in range(3):
            way = end[k] - begin[k]
            squared += way * way
            place[k] = np.int64(begin[k])
            ahead[k] = 1 if np.int64(end[k]) > place[k] else -1
            left[k] = abs(np.int64(end[k]) - place[k])
            following[k] = np.inf
            pace[k] = 0.0
            if left[k] > 0:
                pace[k] = 1.0 / abs(way)
                wall = place[k] + 1 if ahead[k] > 0 else place[k]
                following[k] = abs(wall - begin[k]) * pace[k]
        before = a
        for _ in range(left[0] + left[1] + left[2] - 1):
            axis = -1
            for k in range(3):
                if left[k] > 0 and (axis < 0 or following[k] < following[axis]):
                    axis = k
            place[axis] += ahead[axis]
            left[axis] -= 1
            following[axis] += pace[axis]
            number = numbers[place[0], place[1], place[2]] - 1
            if number < 0:
                continue
            for index in range(starts[number], starts[number + 1]):
                point = _within(points, held[index], low, step)
                if _lies_on(point, begin, end, squared, tolerance):
                    triangles[count, 0] = before
                    triangles[count, 1] = held[index]
                    triangles[count, 2] = b
                    before = held[index]
                    count += 1
                    break
    return count


@inner_kernel
def _lies_on(p, a, b, squared, tolerance):
    """Whether a point is as near as the tolerance to the edge, between its ends."""
    along = 0.0
    for k in range(3):
        along += (p[k] - a[k]) * (b[k] - a[k])
    share = along / squared
    if not 0.0 < share < 1.0:
        return False
    off = 0.0
    for k in range(3):
        off += (p[k] - a[k] - share * (b[k] - a[k])) ** 2
    return off <= tolerance * tolerance
