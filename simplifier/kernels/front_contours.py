"""Fronts of a fine mesh: of most of its triangles one look tells whether they settle their pixels.

The same counts as triangle by triangle (:mod:`simplifier.kernels.front`).  In a view a triangle is
*near* where its farthest corner is before all limits of the block of pixels that its corners span,
and *far* where its nearest corner is behind all of them.  Near ones settle whatever pixel they
cover, so their silhouette is all that is needed of them, and that comes of its contour
(:mod:`simplifier.kernels.contours`).  Far ones settle nothing.  The few that are left are drawn,
and only where pixels still wait.

Cells are those that triangles are drawn by, to the bit.  Depths are compared in 65,536 steps, and
what is not more than a step apart counts as neither near nor far, so rounding decides nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import lowest_one, popcount
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.contours import EdgeTable, count_edges, cover, fill_sides, sight_axes
from simplifier.kernels.coverage import MaskArray, project, views_at_a_time
from simplifier.kernels.front import draw_nearest, settle_face
from simplifier.kernels.threads import run_chunks

_SIDES = np.array([1, 2, 3, 4, 6, 8])  # pixels of a block: each at most twice the one before
_STEPS = 65530.0  # of depth; a few more lie before and behind
_LAST = 65535  # step
_SMALLEST = 1e-9  # of all that a depth is summed of: a step is then far more than rounding


def count_front_by_contours(
    table: EdgeTable,
    shown: MaskArray,
    others: tuple[NDArray[np.float64], NDArray[np.int32]],
    views: NDArray[np.float64],
    image: int,
    threshold: float,
    pixels: NDArray[np.int64],
) -> None:
    """Fill ``pixels`` (V, 2) as :func:`~simplifier.kernels.front.count_front` does.

    ``table``   of the mesh; ``shown`` (V, rows, words) its silhouettes.
    ``others``  vertices (3, n) and faces (m, 3) of the occluder.
    """
    low, high = table.vertices.min(axis=1), table.vertices.max(axis=1)
    ball = np.append(0.5 * (low + high), 0.5 * np.linalg.norm(high - low))
    axes = sight_axes(views[:, :2])
    batch = views_at_a_time(len(table.faces), image)
    run_chunks(
        lambda begin, end: count_fronts(
            table.vertices, table.faces, table.edges, table.planes, axes, *others, views, ball,
            image, threshold, batch, begin * batch, min(end * batch, len(views)), shown, pixels,
        ),
        -(-len(views) // batch),
        chunks_per_thread=8,
    )  # fmt: skip


@kernel(
    "float64[:, :], int32[:, :], int32[:, :], float32[:, :], float32[:, :], float64[:, :], "
    "int32[:, :], float64[:, :, :], float64[:], int64, float64, int64, int64, int64, "
    "uint64[:, :, :], int64[:, :]"
)
def count_fronts(
    vertices, faces, edges, planes, axes, others, other_faces, projections, ball, image, threshold,
    batch, begin, end, shown, pixels,
):  # fmt: skip
    """Fill views ``begin`` to ``end`` of ``pixels``, ``batch`` views at a time, at most 64.

    ``edges``, ``planes``, ``axes``  as :func:`~simplifier.kernels.contours.draw_contours` takes
                them; ``ball`` (4,) holds the vertices: centre and radius.
    ``shown``   (V, image, words) uint64: silhouettes of the mesh.
    """
    count, words = len(faces), (len(faces) + 63) >> 6
    across = (image + 63) >> 6
    most = max(vertices.shape[1], others.shape[1])
    points, cells = np.empty((most, 2)), np.empty(most, np.uint32)
    corners = np.empty(vertices.shape[1], np.uint64)
    blocks = np.empty((len(_SIDES), image + 1, 2 * image + 2), np.uint16)
    near, waiting = np.empty((batch, words), np.uint64), np.empty((batch, words), np.uint64)
    front, back = np.zeros(count + 1, np.uint64), np.zeros(count + 1, np.uint64)
    limits, hidden = np.empty((batch, image, image)), np.empty((batch, image, across), np.uint64)
    close, seen = np.empty_like(hidden), np.zeros((image, across), np.uint64)
    counts = np.zeros((batch, 2, image + 1, image), np.int32)
    unsure = np.empty(batch, np.bool_)
    for first in range(begin, end, batch):
        last = min(first + batch, end)
        views = projections[first:last]
        hidden[:], close[:], unsure[:] = 0, 0, False
        for view in range(last - first):
            draw_nearest(
                others, other_faces, views[view], threshold, points, cells, limits[view],
                hidden[view],
            )  # fmt: skip
            low, steps = _depth_steps(views[view], ball)
            _fill_blocks(limits[view], low, steps, blocks)
            project(vertices, views[view, :2], image, image, points, cells[: len(corners)])
            _pack_corners(vertices, views[view], cells, low, steps, corners)
            _sort_out(faces, corners, blocks, near[view], waiting[view])
        fill_sides(planes, axes[first:last], front, back)
        _turn_words(near[: last - first], front, back, waiting)
        count_edges(vertices, edges, front, views, 1, 0, counts, unsure)
        count_edges(vertices, edges, back, views, -1, 1, counts, unsure)
        for view in range(last - first):
            for side in range(2):
                cover(counts[view, side], image, close[view])
            if unsure[view]:
                close[view] = 0
                waiting[view] |= near[view]
            pixels[first + view, 0] = _leave_waiting(hidden[view], shown[first + view], close[view])
            _draw_left(
                vertices, faces, waiting[view], views[view], limits[view], hidden[view],
                close[view], seen,
            )  # fmt: skip
            pixels[first + view, 1] = 0
            for row in range(image):
                for word in range(across):
                    pixels[first + view, 1] += np.int64(popcount(close[view, row, word]))


@inner_kernel
def _depth_steps(projection, ball):
    """(depth of step 0, steps a unit of depth): the vertices' are from 2 to 65532."""
    a, b, c, d = projection[2]
    length = np.sqrt(a * a + b * b + c * c)
    middle = a * ball[0] + b * ball[1] + c * ball[2] + d
    summed = abs(a * ball[0]) + abs(b * ball[1]) + abs(c * ball[2]) + abs(d) + length * ball[3]
    reach = 1.001 * length * ball[3] + _SMALLEST * summed + 1e-300
    steps = _STEPS / (2.0 * reach)
    return middle - reach - 2.0 / steps, steps


@inner_kernel
def _pack_corners(vertices, projection, cells, low, steps, corners):
    """Fill ``corners`` (n,) uint64: the cell in the upper half, the step of depth in the lower."""
    a, b, c, d = projection[2]
    for vertex in range(len(corners)):
        depth = a * vertices[0, vertex] + b * vertices[1, vertex] + c * vertices[2, vertex] + d
        step = np.uint64(min(max((depth - low) * steps, 2.0), _LAST - 3.0))
        corners[vertex] = (np.uint64(cells[vertex]) << np.uint64(32)) | step


@inner_kernel
def _fill_blocks(limits, low, steps, blocks):
    """Fill for each pixel and side of a block, that begins there, two steps: of the least limit,
    and of the greatest from the last step down.

    ``blocks`` (s, rows + 1, 2 (columns + 1)) uint16; outside the picture nothing limits.
    """
    size, width = len(limits), blocks.shape[2]
    for row in range(size):
        line, steps_of = limits[row], blocks[0, row]
        for column in range(size):
            limit = line[column]
            step = np.uint16(min(max((limit - low) * steps, 0.0), float(_LAST)))
            steps_of[2 * column] = step
            steps_of[2 * column + 1] = _LAST - step if limit < np.inf else _LAST
        steps_of[2 * size], steps_of[2 * size + 1] = _LAST, _LAST
    blocks[0, size] = _LAST
    upright = np.full(width + 2 * _SIDES[-1], _LAST, np.uint16)
    for level in range(1, len(_SIDES)):
        further = _SIDES[level] - _SIDES[level - 1]
        aside = upright[2 * further :]
        for row in range(size + 1):
            here, below = blocks[level - 1, row], blocks[level - 1, min(row + further, size)]
            for place in range(width):
                one, other = here[place], below[place]
                upright[place] = one if one < other else other
            wide = blocks[level, row]
            for place in range(width):
                one, other = upright[place], aside[place]
                wide[place] = one if one < other else other


@inner_kernel
def _sort_out(faces, corners, blocks, near, waiting):
    """Fill a bit a triangle, 64 a word: whether it is near; whether it is to be drawn, since it is
    neither near nor far and spans a centre.

    In loops of their own what is fetched from memory leaves the rest to vector registers.
    """
    side = blocks.shape[1]
    limits = blocks.reshape(-1).view(np.uint32)
    level_size, row_size = np.uint64(side * side), np.uint64(side)
    a, b, c = np.zeros(64, np.uint64), np.zeros(64, np.uint64), np.zeros(64, np.uint64)
    least, most = np.empty(64, np.uint64), np.empty(64, np.uint64)
    place, kind = np.empty(64, np.uint64), np.empty(64, np.uint64)
    limit = np.zeros(64, np.uint64)
    one, sixteen, last = np.uint64(1), np.uint64(16), np.uint64(_LAST)
    upper = np.uint64(48)
    for word in range(len(near)):
        there = min(64, len(faces) - 64 * word)
        for lane in range(there):
            face = 64 * word + lane
            a[lane] = corners[faces[face, 0]]
            b[lane] = corners[faces[face, 1]]
            c[lane] = corners[faces[face, 2]]
        for lane in range(64):
            p, q, r = a[lane], b[lane], c[lane]
            top, bottom = min(min(p, q), r) >> upper, max(max(p, q), r) >> upper
            p, q, r = p << sixteen, q << sixteen, r << sixteen
            left, right = min(min(p, q), r) >> upper, max(max(p, q), r) >> upper
            p, q, r = p << np.uint64(32), q << np.uint64(32), r << np.uint64(32)
            least[lane], most[lane] = min(min(p, q), r) >> upper, max(max(p, q), r) >> upper
            longest = max(bottom - top, right - left)
            level = np.uint64(0)
            for index in range(len(_SIDES) - 1):
                level += np.uint64(longest > np.uint64(_SIDES[index]))
            place[lane] = level * level_size + top * row_size + left
            fits = np.uint64(longest <= np.uint64(_SIDES[-1]))
            spans = np.uint64((top < bottom) & (left < right))
            kind[lane] = fits | (spans << one)
        for lane in range(there):
            limit[lane] = limits[place[lane]]
        nears, draws = np.uint64(0), np.uint64(0)
        for lane in range(64):
            fits, spans = kind[lane] & one, kind[lane] >> one
            behind = fits & np.uint64(least[lane] + (limit[lane] >> sixteen) > last + one)
            before = fits & ~behind & np.uint64(most[lane] + one < (limit[lane] & last))
            nears |= before << np.uint64(lane)
            draws |= (spans & ~(before | behind)) << np.uint64(lane)
        whole = ~np.uint64(0) >> np.uint64(64 - there)
        near[word], waiting[word] = nears & whole, draws & whole


@inner_kernel
def _turn_words(near, front, back, waiting):
    """Keep of ``front`` and ``back``, a word a triangle, the views in which it is near, where
    ``near`` has a word a view; those that are neither are to be drawn."""
    one = np.uint64(1)
    square = np.empty(64, np.uint64)
    every = ~np.uint64(0) >> np.uint64(64 - len(near))
    for word in range(near.shape[1]):
        square[:] = 0
        for view in range(len(near)):
            square[view] = near[view, word]
        _transpose(square)
        for lane in range(min(64, len(front) - 1 - 64 * word)):
            face = 64 * word + lane
            edge_on = square[lane] & ~(front[face] | back[face]) & every
            front[face] &= square[lane]
            back[face] &= square[lane]
            while edge_on != 0:
                lowest, view = lowest_one(edge_on)
                edge_on ^= lowest
                waiting[view, word] |= one << np.uint64(lane)


@inner_kernel
def _transpose(square):
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


@inline_kernel
def _leave_waiting(hidden, shown, close):
    """Turn ``close``, pixels that near triangles cover, into those that wait; count ``shown``."""
    there = np.uint64(0)
    for row in range(len(shown)):
        for word in range(shown.shape[1]):
            there += popcount(shown[row, word])
            close[row, word] = hidden[row, word] & shown[row, word] & ~close[row, word]
    return np.int64(there)


@inline_kernel
def _cell(value, size):
    """The first pixel with its centre at or past a coordinate."""
    return np.uint32(np.int32(np.ceil(min(max(value, 0.0), size))))


@inner_kernel
def _draw_left(vertices, faces, chosen, projection, limits, hidden, waiting, seen):
    """Take out of ``waiting`` what the triangles of the bits ``chosen`` settle."""
    sixteen, size = np.uint32(16), float(len(limits))
    own, points, cells = np.empty((3, 3)), np.empty((3, 2)), np.empty(3, np.uint32)
    depths = np.empty(3)
    a, b, c, d = projection[0]
    e, f, g, h = projection[1]
    d -= 0.5
    h -= 0.5
    for word in range(len(chosen)):
        left = chosen[word]
        while left != 0:
            lowest, place = lowest_one(left)
            left ^= lowest
            face = 64 * word + place
            for corner in range(3):
                vertex = faces[face, corner]
                x, y, z = vertices[0, vertex], vertices[1, vertex], vertices[2, vertex]
                own[0, corner], own[1, corner], own[2, corner] = x, y, z
                x, y = a * x + b * y + c * z + d, e * x + f * y + g * z + h
                points[corner, 0], points[corner, 1] = x, y
                cells[corner] = (_cell(y, size) << sixteen) | _cell(x, size)
            settle_face(
                own, points, cells, projection[2], depths, 0, 1, 2, limits, hidden, waiting, seen
            )
