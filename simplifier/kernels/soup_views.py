"""The pictures of a triangle soup in many views, and what they score as an occluder.

A soup is ``triangles`` (m, 3, 3) float64, corners in grid space.  Views are 64 x 64 bit images:
``projections`` (V, 2, 4) float64 and the original's silhouettes ``originals`` (V, 64) uint64.
``images`` (m, V, 64) uint64 holds each triangle's picture, and ``standing`` (V, 64) that of what
stands beside the soup and never moves.  ``layers`` (V, 2 + d, 64), d as :func:`digit_count` says,
count how many of all these have a pixel: it is in layer 0 where any has it, in layer 1 where two or
more have it, and layers 2 and on are the digits of the number, the lowest first.  So the union of
all but one takes two layers and that one's picture, and a picture is exchanged without the others.

A view scores, in sixteenths of twice a measure, a whole number:

    16 M(occluder and original) - price * (M(occluder) - M(occluder and original))
    - fine * outside - toll * front

so what is hidden wrongly costs by the measure too.  A pixel that closes a gap costs much, as the
quads that it makes full do; a pixel past the outline costs little.  What lies past the outline is
therefore fined by its pixels as well: ``fines`` (V, 2) int64 is what each view asks for one, and
for one in front.

A pixel is in front where any triangle is nearer to the viewer than its limit, so pictures of what
is in front unite as silhouettes do.  Where they are asked for, they are 16 more rows of ``images``
and ``layers``, and of every (V, 64) below but the originals'; row r is at row 4 r + 2 of the
silhouette.  ``depths`` are then three arrays, else they are empty:

    ``away``     (V, 4) float64: the depth of a point p is ``away[:3] @ p + away[3]``
    ``limits``   (V, 16, 64) float32 depths, -inf where the original does not show
    ``highest``  (V, 16) float32, of each row of the limits
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.bit_image import (
    STEPS,
    measure_twice,
    popcount,
    right_of,
)
from simplifier.kernels.compiled.intrinsic import intrinsic
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.voxelize import ROOM, is_contained

Images = NDArray[np.uint64]

INSET = 0.2
"""Pixels by which triangles are drawn smaller, so that neighbours have to overlap: a crack that is
thinner than a pixel escapes pictures as small as these, and breaks every large rectangle in finer
ones."""

FRONT_ROWS = 16
"""Rows of a picture of what is in front: all 64 take longer, and tell no more."""

FRONT_STEP = 64 // FRONT_ROWS
"""Rows of a silhouette for each of them, which lies in their middle."""

UNIT = 16
"""Of a score: the price of what is hidden wrongly is a whole number of sixteenths."""


@kernel("int64")
def digit_count(triangles):
    """Binary digits of a number of triangles, and of what stands beside them."""
    digits = 1
    while triangles + 1 >= 1 << digits:
        digits += 1
    return digits


def empty_pictures(triangles: int, views: int, rows: int) -> tuple[Images, Images]:
    """``images`` and ``layers`` of so many."""
    images = np.zeros((triangles, views, rows), dtype=np.uint64)
    return images, np.zeros((views, 2 + digit_count(triangles), rows), dtype=np.uint64)


@inline_kernel
def corner(triangle, k):
    """Corner ``k`` of a triangle (3, 3) as a triple."""
    return triangle[k, 0], triangle[k, 1], triangle[k, 2]


@inline_kernel
def _outline(p, q, r, m):
    """The outline of a projected triangle that is drawn, ten numbers, as :func:`_outline_bits`
    takes them; ``m`` are the eight numbers of a projection.

    The corners are moved inwards by :data:`INSET`: the triangle shrinks about its incentre, in the
    proportion that the distance leaves of the inscribed circle's radius.  In each row that a
    triangle reaches it has two edges: the one from its top to its bottom, and the upper or the
    lower of the others.  Half a pixel left of the top, its height, how far the long and the upper
    edge go to the right a row; the same of the corner in the middle and the lower edge; the first
    row whose centre lies within, the first of the lower edge, and the one after the last.

    Without a branch, so that a loop over views works on several at once.
    """
    px = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3]
    py = m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7]
    qx = m[0] * q[0] + m[1] * q[1] + m[2] * q[2] + m[3]
    qy = m[4] * q[0] + m[5] * q[1] + m[6] * q[2] + m[7]
    rx = m[0] * r[0] + m[1] * r[1] + m[2] * r[2] + m[3]
    ry = m[4] * r[0] + m[5] * r[1] + m[6] * r[2] + m[7]
    a = np.sqrt((qx - rx) ** 2 + (qy - ry) ** 2)
    b = np.sqrt((rx - px) ** 2 + (ry - py) ** 2)
    c = np.sqrt((px - qx) ** 2 + (py - qy) ** 2)
    around = a + b + c
    twice_area = abs((qx - px) * (ry - py) - (qy - py) * (rx - px))  # the radius times ``around``
    lost = INSET * around / twice_area
    x = (a * px + b * qx + c * rx) / around
    y = (a * py + b * qy + c * ry) / around
    px, py = px + lost * (x - px), py + lost * (y - py)
    qx, qy = qx + lost * (x - qx), qy + lost * (y - qy)
    rx, ry = rx + lost * (x - rx), ry + lost * (y - ry)
    shows = twice_area > INSET * around
    px, py, qx, qy = _upper_first(px, py, qx, qy)
    qx, qy, rx, ry = _upper_first(qx, qy, rx, ry)
    px, py, qx, qy = _upper_first(px, py, qx, qy)
    first = np.ceil(max(py, 0.0) - 0.5)
    lower = np.ceil(max(qy, 0.0) - 0.5)
    last = np.ceil(min(ry, 64.0) - 0.5)
    return (
        px - 0.5, py, (rx - px) / (ry - py), (qx - px) / (qy - py),
        qx - 0.5, qy, (rx - qx) / (ry - qy),
        first, lower, last if shows else 0.0,
    )  # fmt: skip


@inline_kernel
def _upper_first(px, py, qx, qy):
    """Two points, the upper one first."""
    upper_x, lower_x = (qx, px) if py > qy else (px, qx)
    return upper_x, min(py, qy), lower_x, max(py, qy)


@inline_kernel
def _outline_bits(outline, row):
    """The pixels of a row with their centre within an outline.

    Without a branch, so that a loop over all rows works on several at once.
    """
    start, top, long, upper, middle_start, middle, lower, first, split, last = outline
    # From the end of an edge: the slope of a nearly level one is huge.
    one = np.ceil(start + (row + 0.5 - top) * long)
    two = np.ceil(
        start + (row + 0.5 - top) * upper if row < split
        else middle_start + (row + 0.5 - middle) * lower
    )  # fmt: skip
    passes = (row >= first) & (row < last)
    return right_of(one) ^ right_of(two) if passes else np.uint64(0)


@inline_kernel
def _draw_outline(outline, image):
    """Write an image, of which only the eights of rows are computed that an outline reaches.

    Rows are counted by unsigned numbers where a loop does not begin with the first: numba asks of
    each signed one whether it counts from the end, and no loop works on several rows then.
    """
    first, last = outline[7], outline[9]
    for row in range(64):
        image[row] = 0
    if first < last:
        for row in range(int(first) & ~7, (int(last) + 7) & ~7):
            image[np.uint64(row)] = _outline_bits(outline, row)


@inner_kernel
def draw_triangle(p, q, r, m, image):
    """Draw a projected triangle into the first 64 words of ``image``, which it overwrites.

    ``m`` (2, 4) is the projection; neighbours have to overlap, by :data:`INSET`.
    """
    numbers = m[0, 0], m[0, 1], m[0, 2], m[0, 3], m[1, 0], m[1, 1], m[1, 2], m[1, 3]
    _draw_outline(_outline(p, q, r, numbers), image)


BLOCK = 64
"""Views whose outlines are found at once.  A constant, for the compiler to see which numbers lie
next to each other."""


OUTLINE_NUMBERS = 12
"""Of a triangle in a view: ten of its outline, the first row that matters, and the one after the
last."""

_FROM, _TO = 10, 11  # of these twelve, the rows

_EIGHT = 8  # rows of a picture, or views, that a processor works on at once


@inline_kernel
def block_size(views):
    """Numbers in the blocks of so many views.  Some are read past the end of a block."""
    return (views + BLOCK - 1) // BLOCK * (8 * BLOCK) + _EIGHT


@inner_kernel
def put_projection(m, place, blocks):
    """Write a projection (2, 4) for the view at a place among others, as :func:`find_outlines`
    takes them: in each block of views, one number of all projections after the other."""
    begin = place // BLOCK * (8 * BLOCK) + place % BLOCK
    for number in range(8):
        blocks[begin + number * BLOCK] = m[number // 4, number % 4]


@inner_kernel
def find_outlines(p, q, r, triangle, blocks, begin, end, outlines):
    """A triangle's outlines in the views at ``begin`` to ``end``, within one block.

    ``outlines`` (12 * 64,) float64 is overwritten: ten numbers of an outline, each for all views
    one after the other, then the eights of rows that it or ``triangle`` (3, 3) may reach, from the
    first row to the one after the last.  A whole eight of views is looked at in the end: what is
    written for those past it means nothing.
    """
    block = blocks[begin // BLOCK * (8 * BLOCK) + begin % BLOCK :]
    for view in range((end - begin + _EIGHT - 1) & ~(_EIGHT - 1)):
        outline = _outline(
            p, q, r,
            (
                block[view], block[BLOCK + view], block[2 * BLOCK + view],
                block[3 * BLOCK + view], block[4 * BLOCK + view], block[5 * BLOCK + view],
                block[6 * BLOCK + view], block[7 * BLOCK + view],
            ),
        )  # fmt: skip
        outlines[view] = outline[0]
        outlines[BLOCK + view] = outline[1]
        outlines[2 * BLOCK + view] = outline[2]
        outlines[3 * BLOCK + view] = outline[3]
        outlines[4 * BLOCK + view] = outline[4]
        outlines[5 * BLOCK + view] = outline[5]
        outlines[6 * BLOCK + view] = outline[6]
        outlines[7 * BLOCK + view] = outline[7]
        outlines[8 * BLOCK + view] = outline[8]
        outlines[9 * BLOCK + view] = outline[9]
        first, last = 64.0, 0.0
        for x, y, z in (p, q, r, corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)):
            row = (
                block[4 * BLOCK + view] * x + block[5 * BLOCK + view] * y
                + block[6 * BLOCK + view] * z + block[7 * BLOCK + view]
            )  # fmt: skip
            first, last = min(first, row), max(last, row)
        outlines[_FROM * BLOCK + view] = _EIGHT * np.floor(max(first, 0.0) / _EIGHT)
        outlines[_TO * BLOCK + view] = _EIGHT * np.ceil(min(last, 64.0) / _EIGHT)


@inline_kernel
def _outline_of(outlines, view):
    return (
        outlines[view], outlines[BLOCK + view], outlines[2 * BLOCK + view],
        outlines[3 * BLOCK + view], outlines[4 * BLOCK + view], outlines[5 * BLOCK + view],
        outlines[6 * BLOCK + view], outlines[7 * BLOCK + view], outlines[8 * BLOCK + view],
        outlines[9 * BLOCK + view],
    )  # fmt: skip


def _write_draw(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.drawing import write_draw  # with llvmlite

    return write_draw(builder, BLOCK, _FROM, _TO, *given)


@intrinsic(_write_draw)
def _draw_found(outlines, view, layers, height, own, new, eights):
    del height
    outline = _outline_of(outlines, view)
    new[:64], eights[0], differs = 0, 0, np.uint64(0)
    for row in range(int(outlines[_FROM * BLOCK + view]), int(outlines[_TO * BLOCK + view])):
        new[row] = _outline_bits(outline, row)
        differs |= (all_but_one(layers, own, row) | new[row]) ^ layers[0, row]
        eights[0] |= np.uint64(new[row] != own[row]) << np.uint64(row // _EIGHT)
    return differs


@inner_kernel
def draw_found(outlines, view, layers, own, new, eights):
    """Draw a triangle in one of the views that :func:`find_outlines` was asked for last.

    ``new`` (64,) is overwritten.  ``own`` (64,) is the picture of the other triangle that it was
    given, and one of those that ``layers`` (2 + d, 64) count.  Returns the columns, as ones, in
    which their union becomes another one with the new picture in place of it.  The first of
    ``eights`` tells in which eights of rows the two pictures differ, as :func:`exchange_picture`
    takes it.
    """
    return _draw_found(outlines, view, layers, layers.shape[1], own, new, eights)


@inline_kernel
def _along(p, q, m, away):
    """How far a view's x, y and depth go from a corner to another."""
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        away[0] * x + away[1] * y + away[2] * z,
    )


@inner_kernel
def draw_front(p, q, r, m, away, limits, highest, image, front):
    """Fill ``front`` (16,) with the pixels of a triangle that lie before their limits.

    ``image`` (64,) is what :func:`draw_triangle` drew of it, ``m`` (2, 4) the projection, ``away``
    (4,), ``limits`` (16, 64) and ``highest`` (16,) those of the view.  Returns whether there are
    any.
    """
    px = m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3]
    py = m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3]
    ax, ay, az = _along(p, q, m, away)
    bx, by, bz = _along(p, r, m, away)
    area = ax * by - ay * bx
    # Of what has no area no pixel is drawn.
    scale = 1.0 / area if area != 0.0 else 0.0
    right = np.float32((az * by - bz * ay) * scale)
    down = (bz * ax - az * bx) * scale
    start = away[0] * p[0] + away[1] * p[1] + away[2] * p[2] + away[3]
    start += (0.5 - px) * right + (0.5 - py) * down
    # The column of a row's nearest depth.
    nearest = px + (min(ax, bx, 0.0) if right > 0.0 else max(ax, bx, 0.0))
    reach = np.float32(min(max(nearest - 0.5, 0.0), 63.0)) * right
    found = np.uint64(0)
    for row in range(FRONT_ROWS):
        line = FRONT_STEP * row + FRONT_STEP // 2
        word = image[line]
        front[row] = 0
        depth = np.float32(start + line * down)
        if word != 0 and depth + reach < highest[row]:
            before = np.uint64(0)
            for column in range(64):
                bit = np.uint64(depth + np.float32(column) * right < limits[row, column])
                before |= bit << np.uint64(column)
            front[row] = word & before
            found |= front[row]
    return found != 0


@inner_kernel
def count_front(picture):
    """Pixels in front, of the rows of a picture; 0 where none were asked for."""
    count = np.uint64(0)
    for row in range(64, len(picture)):
        count += popcount(picture[row])
    return np.int64(count)


def _write_score(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.erosion import write_score  # with llvmlite

    return write_score(builder, STEPS, UNIT, *given)


@intrinsic(_write_score)
def _score_view(union, original, price, fine):
    part = union[:64] & original
    outside = int(np.bitwise_count(union[:64] ^ part).sum())
    whole, right = measure_twice(union), measure_twice(part)
    return np.int64(UNIT * right - price * (whole - right) - fine * outside).view(np.uint64)


@inner_kernel
def score_view(union, original, price, fine):
    """The score of ``union``, of which the first 64 rows count."""
    return np.int64(_score_view(union, original, price, fine))


def _write_score_of_exchange(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.erosion import write_score_of_exchange  # with llvmlite

    return write_score_of_exchange(builder, STEPS, UNIT, *given)


@intrinsic(_write_score_of_exchange)
def _score_exchange(layers, height, old, new, original, price, fine):
    union = (layers[0] & ~old) | (layers[1] & old) | new
    return _score_view(union, original, price, fine)


@inner_kernel
def score_exchange(layers, old, new, original, price, fine):
    """The score of the union of all pictures with ``new`` (64,) in place of ``old``, which is one
    of those that ``layers`` (2 + d, 64) count; only the first 64 rows matter."""
    return np.int64(_score_exchange(layers, layers.shape[1], old, new, original, price, fine))


@inline_kernel
def all_but_one(layers, image, row):
    """A row of the union of all pictures but one, ``image`` (64,); ``layers`` (2 + d, 64)."""
    own = image[row]
    return (layers[0, row] & ~own) | (layers[1, row] & own)


def _write_exchange(builder: Any, *given: Any) -> Any:
    from simplifier.kernels.compiled.drawing import write_exchange  # with llvmlite

    return write_exchange(builder, *given)


@intrinsic(_write_exchange)
def _exchange(layers, digits, height, old, new, eights):
    del digits, height, eights
    carry, lost = old ^ new, old & ~new
    old[:] = new
    place = 2
    while carry.any():
        digit = layers[place].copy()
        layers[place] ^= carry
        carry &= digit ^ lost
        place += 1
    layers[1] = np.bitwise_or.reduce(layers[3:])
    layers[0] = layers[1] | layers[2]
    return np.uint64(0)


@inline_kernel
def all_eights(picture):
    """A one for each eight of the rows of a picture."""
    return (np.uint64(1) << np.uint64(len(picture) // _EIGHT)) - np.uint64(1)


@inner_kernel
def exchange_picture(layers, old, new, eights):
    """Count ``new`` (64,) in place of ``old``, which it overwrites; ``layers`` (2 + d, 64).

    The two differ at most in those eights of rows of which ``eights``, a uint64, has a one.  Digits
    are added and taken off in one go, since no pixel of a picture does both.
    """
    _exchange(layers, layers.shape[0] - 2, layers.shape[1], old, new, eights)


@inner_kernel
def unite_others(index, images, layers, others):
    """The union of all pictures but that of a triangle: ``others`` (V, 64)."""
    for view in range(len(others)):
        for row in range(others.shape[1]):
            others[view, row] = all_but_one(layers[view], images[index, view], row)


@inner_kernel
def _draw_picture(triangle, view, projections, depths, picture):
    """Fill ``picture`` (64,) with a triangle in a view, and what of it is in front if asked for."""
    p, q, r = corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)
    draw_triangle(p, q, r, projections[view], picture)
    if len(picture) > 64:
        away, limits, highest = depths
        draw_front(
            p, q, r, projections[view], away[view], limits[view], highest[view], picture,
            picture[64:],
        )  # fmt: skip


@kernel(
    "float64[:, :, :], float64[:, :, :], (float64[:, :], float32[:, :, :], float32[:, :]), "
    "uint64[:, :], uint64[:, :, :], uint64[:, :, :]"
)
def draw_soup(triangles, projections, depths, standing, images, layers):
    """Fill ``images`` and ``layers``."""
    picture = np.zeros(images.shape[2], np.uint64)
    every = all_eights(picture)
    images[:] = 0
    layers[:] = 0
    for view in range(len(projections)):
        picture[:] = 0
        exchange_picture(layers[view], picture, standing[view], every)
    for index in range(len(triangles)):
        for view in range(len(projections)):
            _draw_picture(triangles[index], view, projections, depths, picture)
            exchange_picture(layers[view], images[index, view], picture, every)


@kernel(
    "float64[:, :, :], float64[:, :, :], (float64[:, :], float32[:, :, :], float32[:, :]), "
    "uint64[:, :]"
)
def draw_union(triangles, projections, depths, union):
    """Add all triangles to ``union`` (V, 64), which takes none of the memory of their pictures."""
    picture = np.zeros(union.shape[1], np.uint64)
    for index in range(len(triangles)):
        for view in range(len(projections)):
            _draw_picture(triangles[index], view, projections, depths, picture)
            for row in range(len(picture)):
                union[view, row] |= picture[row]


@kernel("uint64[:, :], uint64[:, :], int64, int64[:, :], int64[:]")
def score_unions(unions, originals, price, fines, scores):
    """Score ``unions`` (V, 64) view by view into ``scores`` (V,) int64; return the sum."""
    total = np.int64(0)
    for view in range(len(unions)):
        scores[view] = score_view(unions[view], originals[view], price, fines[view, 0])
        scores[view] -= fines[view, 1] * count_front(unions[view])
        total += scores[view]
    return total


@kernel("uint64[:, :, :], uint64[:, :, :], uint64[:, :], int64, int64[:, :], int64[:], bool[:]")
def remove_useless(images, layers, originals, price, fines, scores, kept):
    """Take out triangle after triangle without which the score is no less.

    ``kept`` (m,) bool is written; ``images`` of those taken out are cleared, ``layers`` and
    ``scores`` follow.  The last triangles go first: where two show the same, the first stays.
    """
    others = np.zeros(images.shape[1:], np.uint64)
    nothing = np.zeros(images.shape[2], np.uint64)
    every = all_eights(nothing)
    trial = np.zeros(len(scores), np.int64)
    total = np.sum(scores)
    kept[:] = True
    found = True
    while found:
        found = False
        for index in range(len(images) - 1, -1, -1):
            if not kept[index]:
                continue
            unite_others(index, images, layers, others)
            without = score_unions(others, originals, price, fines, trial)
            if without < total:
                continue
            kept[index] = False
            found = True
            total = without
            for view in range(len(scores)):
                scores[view] = trial[view]
                exchange_picture(layers[view], images[index, view], nothing, every)


@kernel(f"float64[:, :, :], {ROOM}, bool[:]")
def all_contained(triangles, room, inside):
    """Write into ``inside`` (m,) bool whether each triangle keeps to ``room``."""
    for index in range(len(triangles)):
        inside[index] = is_contained(
            corner(triangles[index], 0), corner(triangles[index], 1), corner(triangles[index], 2),
            room,
        )  # fmt: skip
