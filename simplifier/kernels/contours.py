"""Silhouettes of a fine mesh by its contour, bit for bit what drawing each triangle gives.

In a view the triangles that face the viewer cover a pixel as often as their directed edges cross
its row to the left of it, counted by direction.  Where two such triangles share an edge its two
crossings are the same number and cancel, so only edges between triangles that face differently
count (the contour; Appel 1967), and open ones.  A fine mesh has a hundred triangles for each.

A closed mesh is covered by what faces the viewer where it is covered at all; an open one also by
what faces away, which covers a pixel as often less what the mesh's open edges count.  Triangles so
near to edge-on that rounding could turn them are drawn one by one.  Where a contour's vertex is so
near to a pixel's centre that rounding could take its two edges for each other, the view is drawn
triangle by triangle.

Vertices, triangles and edges lie along a curve through space, so what is looked at together is
near at hand.  Edges are read once for some views; what they count is listed by view and summed up
one view after the other, since the sums of many views would not fit in a cache.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.intrinsic import intrinsic
from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.coverage import MaskArray, views_at_a_time
from simplifier.kernels.edges import list_edges
from simplifier.kernels.faces import draw_face, draw_faces, empty_spans, lies_between, project
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent

_MOST_LISTED = 0.3  # of the edges, in a view: more of them cost what they save
_CROWDED = 0.25  # the power of the pixels a triangle below one, by which triangles get cheaper
_SAMPLE = 1024  # edges, by which their angles are known to a hundredth
_WORDS = 64  # of 64 edges each at a time
_EDGES = 256  # of a view at a time
_LISTED = 1 << 16  # crossings of a view; where there are more, its edges are read again
_COUNT, _UNSURE, _NO_ROOM = np.uint64((1 << 32) - 1), np.uint64(1 << 32), np.uint64(1 << 33)
_EDGE_ON = 1e-4  # of the square of the longest edge: below that, twice the area counts as none
_NEAR = 1e-5  # pixels: rounding moves a crossing by 1e-7 at most where a triangle ends
_FAR = 1e4  # pixels: up to there it does
_CELLS = 1023  # along the mesh's longest side: ten bits of a place on the curve
_SPREAD = ((16, 0xFF0000FF), (8, 0x0F00F00F), (4, 0xC30C30C3), (2, 0x49249249))

LEAST_LENGTH = 1e-300
"""Of what is divided by: the quotient is then finite."""


@dataclass(frozen=True)
class EdgeTable:
    """A mesh with its edges, all along a curve through space.

    ``vertices``  (n, 3) float64, no two with the same bits; ``faces`` (m, 3) int32.
    ``planes``  (m, 4) float32 as :func:`fill_planes` fills them.
    ``edges``   (e, 4) int32: from, to, the triangle that it runs along, and the one on the other
                side, along which it runs backwards; where there is none the number of triangles.
    ``open``    how many have none.
    ``contour`` the share of the others that is of the contour, in the mean of all views.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    planes: NDArray[np.float32]
    edges: NDArray[np.int32]
    open: int
    contour: float

    def pays(self, pixels: int) -> bool:
        """Whether so few edges are listed in a picture of so many pixels that it is drawn sooner
        than by triangles, most of which lie between pixels where these are few."""
        listed = self.contour + 1.5 * self.open / len(self.edges)  # those that face it twice
        return listed <= _MOST_LISTED * math.pow(min(pixels / len(self.faces), 1.0), _CROWDED)

    @property
    def sides(self) -> int:
        """Ways to face that have to be drawn: of a closed mesh either shows all."""
        return 2 if self.open else 1


def edge_table(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> EdgeTable:
    """Of ``vertices`` (3, n) and ``faces`` (m, 3); vertices at the same place become one."""
    points, sorted_faces = _along_curve(*_joined(vertices, faces))
    planes = np.empty((len(faces), 4), dtype=np.float32)
    fill_planes(points, sorted_faces, planes)
    edges, alone = _edges_of(sorted_faces, len(points))
    contour = _contour_share(edges[: len(edges) - alone], planes)
    return EdgeTable(points, sorted_faces, planes, edges, alone, contour)


def _along_curve(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices (n, 3) in the order of their cells along a curve (Morton 1966), and faces in that
    of their first vertices; of ``vertices`` (3, n) and ``faces`` (m, 3)."""
    low = vertices.min(axis=1, keepdims=True)
    longest = float((vertices.max(axis=1, keepdims=True) - low).max())
    scale = _CELLS / longest if longest > LEAST_LENGTH else 0.0
    bits = ((vertices - low) * scale).astype(np.uint32)
    for shift, mask in _SPREAD:
        bits = (bits | bits << np.uint32(shift)) & np.uint32(mask)
    order = np.argsort(bits[0] | bits[1] << np.uint32(1) | bits[2] << np.uint32(2))
    places = np.empty(len(order), dtype=np.int32)
    places[order] = np.arange(len(order), dtype=np.int32)
    along = np.empty_like(faces)
    sort_faces(faces, places, np.zeros(len(order) + 1, dtype=np.int32), along)
    return np.take(vertices.T, order, axis=0), along


def _joined(
    vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Of vertices with the same bits the first one alone, in the order that they had."""
    x, y, z = np.ascontiguousarray(vertices).view(np.uint64)
    mixed = x * np.uint64(0x9E3779B97F4A7C15)
    mixed = ((mixed ^ (mixed >> np.uint64(29))) + y) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = ((mixed ^ (mixed >> np.uint64(31))) + z) * np.uint64(0x94D049BB133111EB)
    mixed ^= mixed >> np.uint64(30)
    ordered = np.sort(mixed)  # an eighth of the time of what follows
    if not (ordered[1:] == ordered[:-1]).any():
        return vertices, faces
    # As np.unique does, which sorts by merging: that takes five times as long.
    order = np.argsort(mixed)
    ordered = mixed[order]
    begins = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
    first = np.empty_like(order)
    first[order] = np.repeat(np.minimum.reduceat(order, begins), np.diff(begins, append=len(order)))
    if not np.array_equal(np.take(vertices, first, axis=1), vertices):  # two are mixed alike
        return vertices, faces
    kept = np.zeros(len(first), dtype=np.bool_)
    kept[first] = True
    places = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    return np.take(vertices, np.flatnonzero(kept), axis=1), places[first][faces]


def _edges_of(faces: NDArray[np.int32], vertices: int) -> tuple[NDArray[np.int32], int]:
    """Edges as :class:`EdgeTable` has them, and how many have one triangle: the last ones."""
    edges = np.empty((faces.size, 4), dtype=np.int32)  # whose middle is not written
    starts = np.zeros(vertices + 2, dtype=np.int32)
    paired, alone = pair_edges(faces, starts, edges)
    return np.concatenate([edges[:paired], edges[len(edges) - alone :]]), alone


def _contour_share(edges: NDArray[np.int32], planes: NDArray[np.float32]) -> float:
    """Of edges with two triangles, as :class:`EdgeTable` has them: a random view sees the two from
    different sides with the probability that the angle of their normals is of a half turn."""
    some = edges[:: max(len(edges) // _SAMPLE, 1)]
    one, other = (planes[some[:, side], :3].astype(np.float64) for side in (2, 3))
    with np.errstate(invalid="ignore"):  # areas may be beyond float32: no share pays then
        lengths = np.sqrt((one * one).sum(axis=1) * (other * other).sum(axis=1))
        cosines = (one * other).sum(axis=1) / np.maximum(lengths, LEAST_LENGTH)
        angles = np.arccos(np.clip(cosines, -1.0, 1.0))
    return float(angles.mean() / np.pi) if len(some) > 0 else 0.0


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
    batch = views_at_a_time(len(views))

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
        i, j, k = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        ax, bx = j[0] - i[0], k[0] - i[0]
        ay, by = j[1] - i[1], k[1] - i[1]
        az, bz = j[2] - i[2], k[2] - i[2]
        cx, cy, cz = bx - ax, by - ay, bz - az
        planes[face, 0] = ay * bz - az * by
        planes[face, 1] = az * bx - ax * bz
        planes[face, 2] = ax * by - ay * bx
        longest = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
        planes[face, 3] = _EDGE_ON * max(longest, cx * cx + cy * cy + cz * cz)


@kernel("int32[:, :], int32[:], int32[:], int32[:, :]")
def sort_faces(faces, places, starts, along):
    """Write ``faces`` (m, 3) int32 to ``along``, their vertices by ``places`` (n,), in the order of
    the lowest of these; ``starts`` (n + 1,) int32 zeros."""
    for face in range(len(faces)):
        a, b, c = places[faces[face, 0]], places[faces[face, 1]], places[faces[face, 2]]
        starts[min(a, b, c) + 1] += 1
    for place in range(1, len(starts)):
        starts[place] += starts[place - 1]
    for face in range(len(faces)):
        a, b, c = places[faces[face, 0]], places[faces[face, 1]], places[faces[face, 2]]
        row = starts[min(a, b, c)]
        along[row, 0], along[row, 1], along[row, 2] = a, b, c
        starts[min(a, b, c)] += 1


@kernel("int32[:, :], int32[:], int32[:, :]")
def pair_edges(faces, starts, edges):
    """Write edges with two triangles, which run along them in opposite directions, from the front
    of ``edges`` (3 m, 4) on, and those of all others from the back; return how many of each.

    Of more than two triangles at an edge, any two that run in opposite directions are a pair: their
    crossings cancel whoever else is there.

    ``faces``   (m, 3) int32.
    ``starts``  (n + 2,) int32, zeros.
    """
    listed = list_edges(faces, starts)
    last = np.full(len(starts) - 2, -1, np.int32)  # row of one place without a pair, by other end
    before = np.empty(len(listed), np.int32)  # the one that was the last when a row came
    paired, alone = 0, 0
    for place in range(len(last)):
        begin, end = starts[place], starts[place + 1]
        for row in range(begin, end):
            other, face = listed[row, 0], listed[row, 1]
            waiting = last[other]
            if waiting < 0 or face ^ listed[waiting, 1] >= 0:
                before[row], last[other] = waiting, row
                continue
            last[other] = before[waiting]
            edges[paired, 0], edges[paired, 1] = place, other
            edges[paired, 2] = max(face, listed[waiting, 1])
            edges[paired, 3] = ~min(face, listed[waiting, 1])
            paired += 1
        for row in range(begin, end):
            other = listed[row, 0]
            waiting, last[other] = last[other], -1
            while waiting >= 0:
                face = listed[waiting, 1]
                alone += 1
                edge = edges[len(edges) - alone]
                edge[0], edge[1] = (place, other) if face >= 0 else (other, place)
                edge[2], edge[3] = face ^ (face >> 31), len(faces)
                waiting = before[waiting]
    return paired, alone


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


def _cell(value, count):
    """The first pixel with its centre at or past a coordinate."""
    return np.int32(np.ceil(min(max(value, 0.0), count)))


def _on_centre(x, y):
    """Whether rounding matters to the crossings that end here."""
    near = (abs(x - np.rint(x)) < _NEAR) & (abs(y - np.rint(y)) < _NEAR)
    return near | (max(abs(x), abs(y)) > _FAR)


@inner_kernel
def transpose(square):
    """Of 64 x 64 bits, in place (Warren, Hacker's Delight, section 7-3)."""
    width, mask = 32, np.uint64(0xFFFFFFFF)
    while width != 0:
        shift = np.uint64(width)
        for begin in range(0, 64, 2 * width):
            for place in range(begin, begin + width):
                other = ((square[place] >> shift) ^ square[place + width]) & mask
                square[place + width] ^= other
                square[place] ^= other << shift
        width >>= 1
        mask ^= mask << np.uint64(width)


@inner_kernel
def list_crossings(
    vertices, edges, bits, begin, end, projections, turned, lists, used, unsure, counts
):
    """List where the contour of the triangles that have a view's bit crosses rows, in each view.

    ``begin``, ``end``  the views; each has a bit of ``bits`` (m + 1,), the last of which is 0.
    ``turned``  (V,) bool: count by the other direction.
    ``lists``   (V, n) int32, of which ``used`` (V,) are filled: the place in ``counts`` (columns +
                1, rows), the bits of it turned over where it counts less.  -1 if there is no room;
                of one view alone, what has none is counted at once.
    ``unsure``  (V,) bool: set where rounding matters.
    """
    words = (len(edges) + 63) >> 6
    own, other = np.zeros((_WORDS, 64), np.uint64), np.zeros((_WORDS, 64), np.uint64)
    some, count, numbers = np.empty(_EDGES + 8, np.int32), 0, np.empty(10)
    used[begin:end] = 0
    for first in range(0, words, _WORDS):
        there = min(_WORDS, words - first)
        for word in range(there):
            _turn_contour(edges, bits, 64 * (first + word), own[word], other[word])
        for view in range(begin, end):
            if used[view] < 0:
                continue
            for word in range(there):
                waiting = own[word, view] | other[word, view]
                while waiting != 0:
                    lowest, lane = lowest_one(waiting)
                    waiting ^= lowest
                    edge = 64 * (first + word) + lane
                    some[count] = edge if own[word, view] & lowest != 0 else ~edge
                    count += 1
                if count > _EDGES - 64 or (word + 1 == there and count > 0):
                    used[view], near = _list_some(
                        vertices, edges, some, count, projections[view], turned[view], numbers,
                        lists[view], used[view], counts, end - begin == 1,
                    )  # fmt: skip
                    unsure[view] |= near
                    count = 0
                    if used[view] < 0:
                        break


@inner_kernel
def _turn_contour(edges, bits, first, own, other):
    """Fill of 64 edges from the ``first`` on a bit an edge, a word a view: whether the triangle
    that it runs along has the view's bit and the other one has not; and vice versa."""
    there = min(64, len(edges) - first)
    some = np.uint64(0)
    for lane in range(there):
        own[lane], other[lane] = bits[edges[first + lane, 2]], bits[edges[first + lane, 3]]
    for lane in range(there):
        both = own[lane] & other[lane]
        own[lane] ^= both
        other[lane] ^= both
        some |= own[lane] | other[lane]
    own[there:], other[there:] = 0, 0
    if some != 0:
        transpose(own)
        transpose(other)


def _write_list_eight(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.crossings import write_list_eight  # with llvmlite

    return write_list_eight(builder, _NEAR, _FAR, int(_UNSURE), int(_NO_ROOM), *given)


@intrinsic(_write_list_eight)
def list_eight(vertices, edges, some, begin, left, view, turned, crossings, room, used):
    """List where eight edges cross rows behind ``used`` others, in any order.

    ``some``   int32, of which those from ``begin`` on are looked at, ``left`` of them at most: an
               edge, its bits turned over where the triangle that it runs along has no bit.
    ``view``   (10,) float64: the two rows of a projection to pixels whose centres are whole
               numbers, and how many columns and rows there are.
    ``turned``, ``crossings``  as of :func:`list_crossings`, of one view; ``room`` how many there is
               room for.  Up to eight behind the last one are overwritten.

    Returns, as a uint64, how many are listed now, and bit 32 where rounding matters; or bit 33
    alone, and lists none, where there is not room enough.
    """
    a, b, c, d, e, f, g, h, columns, height = view
    ends, unsure = [], False
    for named in some[begin : begin + min(left, 8)]:
        i, j = edges[named ^ (named >> 31)][:2]
        (x, y, z), (u, v, w) = vertices[i], vertices[j]
        low_x, low_y = a * x + b * y + c * z + d, e * x + f * y + g * z + h
        high_x, high_y = a * u + b * v + c * w + d, e * u + f * v + g * w + h
        first, last = _cell(low_y, height), _cell(high_y, height)
        less = (named >> 31) ^ -int(turned)
        if first < last:
            ends.append((first, last, ~less, low_x, low_y, high_x, high_y))
        elif first > last:
            ends.append((last, first, less, high_x, high_y, low_x, low_y))
        if first != last:
            unsure |= bool(_on_centre(low_x, low_y) | _on_centre(high_x, high_y))
    if used + sum(last - first for first, last, *_ in ends) + 8 > room:
        return _NO_ROOM
    for step in range(max((last - first for first, last, *_ in ends), default=0)):
        for first, last, less, low_x, low_y, high_x, high_y in ends:
            row = first + step
            if row < last:
                x = low_x + (row - low_y) / (high_y - low_y) * (high_x - low_x)
                crossings[used] = (_cell(x, columns) * int(height) + row) ^ less
                used += 1
    return np.uint64(used) | (_UNSURE if unsure else np.uint64(0))


@inner_kernel
def _list_some(
    vertices, edges, some, count, projection, turned, view, crossings, used, counts, alone
):
    """(used, unsure) of a view after ``count`` edges of ``some``; ``view`` (10,) is scratch."""
    for k in range(4):
        view[k], view[4 + k] = projection[0, k], projection[1, k]
    view[3] -= 0.5
    view[7] -= 0.5
    view[8], view[9] = float(counts.shape[0] - 1), float(counts.shape[1])
    some[count : count + 8] = some[0]  # is not looked at, but what it names is fetched
    unsure, begin = False, 0
    while begin < count:
        found = list_eight(
            vertices, edges, some, begin, count - begin, view, np.int64(turned), crossings,
            len(crossings), used,
        )  # fmt: skip
        if found == _NO_ROOM:
            if not alone:
                return -1, unsure
            add_crossings(crossings[:used], counts)
            used = 0
            continue
        used = np.int64(found & _COUNT)
        unsure |= found & _UNSURE != 0
        begin += 8
    return used, unsure


@inner_kernel
def add_crossings(crossings, counts):
    """Add to ``counts`` what :func:`list_crossings` has listed of a view."""
    flat = counts.reshape(-1)
    for place in range(len(crossings)):
        less = crossings[place] >> 31
        flat[crossings[place] ^ less] += np.int32(1) | less


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
def cover_either(counts, mask):
    """As :func:`cover`, of ``counts`` (2, columns + 1, rows): where the first sum is more than
    none, or that of both."""
    rows, columns = mask.shape[0], counts.shape[1] - 1
    one, both = np.zeros(rows, np.int32), np.zeros(rows, np.int32)
    bits = np.empty(rows, np.uint32)
    for half in range((columns + 31) // 32):
        bits[:] = 0
        for place in range(min(columns - 32 * half, 32)):
            line, other = counts[0, 32 * half + place], counts[1, 32 * half + place]
            for row in range(rows):
                one[row] += line[row]
                both[row] += line[row] + other[row]
                line[row], other[row] = 0, 0
                bits[row] |= np.uint32(max(one[row], both[row]) > 0) << np.uint32(place)
        for row in range(rows):
            mask[row, half >> 1] |= np.uint64(bits[row]) << np.uint64(32 * (half & 1))
    counts[:, columns] = 0  # right of the picture


@inner_kernel
def _draw_edge_on(vertices, faces, front, back, projections, columns, masks):
    """Draw the triangles that have neither bit of a view."""
    rows, views = masks.shape[1], len(projections)
    every = ~np.uint64(0) >> np.uint64(64 - views)
    corners, points, cells = np.empty((3, 3)), np.empty((3, 2)), np.empty(3, np.uint32)
    spans = empty_spans(masks[0])
    for face in range(len(faces)):
        waiting = ~(front[face] | back[face]) & every
        if waiting != 0:
            for corner in range(3):
                for axis in range(3):
                    corners[axis, corner] = vertices[faces[face, corner], axis]
        while waiting != 0:
            lowest, view = lowest_one(waiting)
            waiting ^= lowest
            project(corners, projections[view], rows, columns, points, cells)
            if not lies_between(cells[0], cells[1], cells[2]):
                draw_face(points, cells, 0, 1, 2, columns, masks[view], spans)


@kernel(
    "float64[:, :], int32[:, :], int32[:, :], float32[:, :], float32[:, :], float64[:, :, :], "
    "int64, int64, int64, int64, int64, uint64[:, :, :]"
)
def draw_contours(
    vertices, faces, edges, planes, axes, projections, columns, sides, batch, begin, end, masks
):
    """Set the covered bits of ``masks[begin:end]``, ``batch`` views at a time, at most 64.

    ``vertices`` to ``planes`` and ``sides`` are those of an :class:`EdgeTable`, ``axes`` (V, 4)
    those of :func:`sight_axes`.
    """
    front, back = np.zeros(len(faces) + 1, np.uint64), np.zeros(len(faces) + 1, np.uint64)
    counts = np.zeros((sides, columns + 1, masks.shape[1]), np.int32)
    lists, used, unsure = contour_lists(batch, masks.shape[1])
    others, others_used, _ = contour_lists(batch if sides == 2 else 0, masks.shape[1])
    turned = np.zeros(batch, np.bool_)
    for first in range(begin, end, batch):
        last = min(first + batch, end)
        views, pictures = projections[first:last], masks[first:last]
        fill_sides(planes, axes[first:last], front, back)
        unsure[:] = False
        if sides == 2:
            back |= front
            _draw_both_sides(
                vertices, edges, front, back, views, (lists, others), (used, others_used), unsure,
                counts, pictures,
            )  # fmt: skip
        else:
            draw_contour(
                vertices, edges, front, views, turned, lists, used, unsure, counts[0], pictures
            )
        for view in range(last - first):
            if unsure[view]:
                pictures[view] = 0
        _draw_edge_on(vertices, faces, front, back, views, columns, pictures)
        if unsure[: last - first].any():
            _draw_unsure(vertices, faces, views, unsure, columns, pictures)


@inner_kernel
def _draw_both_sides(
    vertices, edges, front, either, projections, lists, used, unsure, counts, masks
):
    """Set in ``masks`` (V, rows, words) what triangles with a view's bit in ``either`` cover, of
    which those in ``front`` are wound one way and the others the other way.

    ``lists``, ``used``  two each, as of :func:`list_crossings`, and two ``counts``.

    The contour of those wound the other way is not looked for: they cover a pixel as often as the
    front, less what the edges of all together count.  Few of these do not cancel: open ones, and
    those of triangles that are edge-on.
    """
    views, bits = len(projections), (front, either)
    turned = np.zeros(views, np.bool_), np.ones(views, np.bool_)
    for part in range(2):
        list_crossings(
            vertices, edges, bits[part], 0, views, projections, turned[part], lists[part],
            used[part], unsure, counts[part],
        )  # fmt: skip
    for view in range(views):
        for part in range(2):
            _count_listed(
                vertices, edges, bits[part], view, projections, turned[part], lists[part],
                used[part], unsure, counts[part],
            )  # fmt: skip
        cover_either(counts, masks[view])


@inner_kernel
def contour_lists(views, rows):
    """What :func:`draw_contour` needs for so many: ``lists``, ``used`` and ``unsure``."""
    lists = np.empty((views, max(_LISTED, 8 * rows + 8)), np.int32)  # for any eight edges
    return lists, np.empty(views, np.int64), np.empty(views, np.bool_)


@inner_kernel
def draw_contour(vertices, edges, bits, projections, turned, lists, used, unsure, counts, masks):
    """Set in ``masks`` (V, rows, words) what triangles with a view's bit cover.

    Other arguments as of :func:`list_crossings`; ``counts`` is 0 before and after.
    """
    views = len(projections)
    list_crossings(
        vertices, edges, bits, 0, views, projections, turned, lists, used, unsure, counts
    )
    for view in range(views):
        _count_listed(vertices, edges, bits, view, projections, turned, lists, used, unsure, counts)
        cover(counts, len(counts) - 1, masks[view])


@inner_kernel
def _count_listed(vertices, edges, bits, view, projections, turned, lists, used, unsure, counts):
    """Add to ``counts`` what :func:`list_crossings` has found of a view, and find it once more
    where its list had no room."""
    if used[view] < 0:
        list_crossings(
            vertices, edges, bits, view, view + 1, projections, turned, lists, used, unsure, counts
        )
    add_crossings(lists[view, : used[view]], counts)


@inner_kernel
def _draw_unsure(vertices, faces, projections, unsure, columns, masks):
    """Draw all triangles in those views."""
    points, cells = np.empty((len(vertices), 2)), np.empty(len(vertices), np.uint32)
    corners = np.ascontiguousarray(vertices.T)
    for view in range(len(projections)):
        if unsure[view]:
            project(corners, projections[view], masks.shape[1], columns, points, cells)
            draw_faces(points, cells, faces, columns, masks[view])
