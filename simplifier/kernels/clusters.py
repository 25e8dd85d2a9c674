"""Whether triangles of a fine mesh lie before or behind limits of depth: for most, one look tells.

Sixteen triangles that are next to each other are a *cluster*, with a box around it.  In a view the
limits become the least and the greatest of blocks of 1 to 16 pixels a side that begin at each
pixel.  One look at the block that a cluster's box spans tells whether all of it is before all
limits there (*near*), or behind all of them (*far*); and where it is neither, one look for each of
its triangles.  Limits tell nothing of a pixel that has none: all is behind it where no other has.

All of that is float32: pixels and steps of depth, 65,520 over the mesh, are widened by what
rounding may move them, and what is not more than a step apart is neither near nor far.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.contours import LEAST_LENGTH

CLUSTER = 16
"""Triangles."""

_LEVELS = 5  # of blocks: 1, 2, 4, 8 and 16 pixels a side
_TILE = 64  # clusters whose boxes lie together
_STEPS = 65520.0  # of depth; some more lie before and behind
_LAST = 65535  # step
_SMALLEST = 1e-9  # of all that a depth is summed of: a step is then far more than rounding
_ROUNDING = 1e-6  # of all that a coordinate is summed of
_MOST = 1e6  # that is summed, steps or pixels: a coordinate is else anywhere
_FAR, _NEAR, _MIXED = 0, 1, 2


@kernel("float64[:, :], int32[:, :], float64[:], float32[:, :], float32[:, :], float64[:, :]")
def fill_clusters(vertices, faces, ball, corners, boxes, moments):
    """Fill what tells of the clusters of ``faces`` (m, 3) int32.

    ``vertices``  (n, 3) float64; ``ball`` (4,) float64 holds them: centre and radius.
    ``corners``   (clusters, 144) float32, radii from the centre: by corner, axis and triangle.
    ``boxes``     (tiles, 384) float32: of 64 clusters centres by axis, then half extents.
    ``moments``   (4, 3) float64: the sum of the normals, each as long as its triangle's area,
                  and these by the axes of the triangles' centres.
    """
    scale = 1.0 / ball[3] if ball[3] > LEAST_LENGTH else 0.0
    own = np.empty((3, 3))
    boxes[:], moments[:] = 0.0, 0.0
    for cluster in range(len(corners)):
        box, lane = boxes[cluster // _TILE], cluster % _TILE
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for place in range(CLUSTER):
            face = CLUSTER * cluster + place
            for corner in range(3):
                vertex = faces[min(face, len(faces) - 1), corner]
                for axis in range(3):
                    value = (vertices[vertex, axis] - ball[axis]) * scale
                    own[corner, axis] = value
                    low[axis], high[axis] = min(low[axis], value), max(high[axis], value)
                    corners[cluster, CLUSTER * (3 * corner + axis) + place] = value
            if face < len(faces):
                _add_moments(own, moments)
        for axis in range(3):
            box[_TILE * axis + lane] = 0.5 * (low[axis] + high[axis])
            box[_TILE * (axis + 3) + lane] = 0.5 * (high[axis] - low[axis])


@inline_kernel
def _add_moments(own, moments):
    for axis in range(3):
        y, z = (axis + 1) % 3, (axis + 2) % 3
        normal = 0.5 * (
            (own[1, y] - own[0, y]) * (own[2, z] - own[0, z])
            - (own[1, z] - own[0, z]) * (own[2, y] - own[0, y])
        )
        moments[0, axis] += normal
        for other in range(3):
            centre = (own[0, other] + own[1, other] + own[2, other]) / 3.0
            moments[1 + other, axis] += normal * centre


@inner_kernel
def fill_map(projection, ball, sight):
    """Fill ``sight`` (3, 5) float32, the map from radii about the ball's centre to column, row and
    step of depth.

    A row has three factors, what is added to their sum, and by how much rounding may move it.
    Pixels have their centres at the integers.  Returns (depth of step 0, steps a unit of depth);
    vertices have steps 8 to 65528.
    """
    low, steps = _depth_steps(projection, ball)
    for axis in range(3):
        a, b, c, d = projection[axis]
        scale = steps if axis == 2 else 1.0
        d += a * ball[0] + b * ball[1] + c * ball[2] - (low if axis == 2 else 0.5)
        a, b, c, d = a * ball[3] * scale, b * ball[3] * scale, c * ball[3] * scale, d * scale
        summed = abs(a) + abs(b) + abs(c) + abs(d) + 1.0
        if summed < _MOST:
            sight[axis, 0], sight[axis, 1], sight[axis, 2], sight[axis, 3] = a, b, c, d
            sight[axis, 4] = _ROUNDING * summed
        else:
            sight[axis, :4], sight[axis, 4] = 0.0, _MOST
    return low, steps


@inner_kernel
def _depth_steps(projection, ball):
    a, b, c, d = projection[2]
    length = np.sqrt(a * a + b * b + c * c)
    middle = a * ball[0] + b * ball[1] + c * ball[2] + d
    summed = abs(a * ball[0]) + abs(b * ball[1]) + abs(c * ball[2]) + abs(d) + length * ball[3]
    reach = 1.001 * length * ball[3] + _SMALLEST * summed + LEAST_LENGTH
    steps = _STEPS / (2.0 * reach)
    return middle - reach - 8.0 / steps, steps


@inner_kernel
def block_limits(image):
    """(blocks, limits) of pictures of ``image`` pixels a side: what :func:`fill_blocks` fills, and
    the same (s (image + 1)^2 + 1,) uint32; the last one tells nothing."""
    side = image + 1
    both = np.zeros(2 * (_LEVELS * side * side + 1), np.uint16)
    return both[:-2].reshape(_LEVELS, side, 2 * side), both.view(np.uint32)


@inner_kernel
def fill_blocks(limits, low, steps, blocks):
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
    upright = np.full(width + (1 << _LEVELS), _LAST, np.uint16)
    for level in range(1, _LEVELS):
        further = 1 << (level - 1)
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


@inline_kernel
def _up(value, size):
    """The first pixel with its centre at or past a coordinate."""
    return np.ceil(min(max(value, np.float32(0.0)), size))


@inline_kernel
def _place(left, right, top, bottom, side):
    """Of the limits of the block that holds a rectangle of pixels: one that tells nothing if no
    block is as large, one outside of the picture if no centre is in it."""
    longest = max(bottom - top, right - left)
    level = np.int32(0)
    for index in range(_LEVELS):
        level += np.int32(longest > np.float32(1 << index))
    place = level * np.int32(side * side) + np.int32(top) * np.int32(side) + np.int32(left)
    place = place if level < _LEVELS else np.int32(_LEVELS * side * side)
    return place if (top < bottom) & (left < right) else np.int32(side * side - 1)


@inline_kernel
def _is_behind(least, limit):
    """Whether what begins at a step of depth is behind all limits."""
    greatest = np.float32(np.int32(limit >> np.uint32(16)))  # from the last step down
    return least + greatest > np.float32(_LAST + 2)


@inline_kernel
def _is_before(most, limit):
    """Whether what ends at a step of depth is before all limits."""
    return most < np.float32(np.int32(limit & np.uint32(_LAST))) - np.float32(1.0)


@inner_kernel
def sort_clusters(boxes, sight, image, limits, kinds):
    """Fill ``kinds`` (clusters,) uint8: far, as is what holds no pixel's centre; near; or mixed."""
    side, size = image + 1, np.float32(image)
    depths, place = np.empty(2 * _TILE, np.float32), np.empty(_TILE, np.int32)
    limit = np.empty(_TILE, np.uint32)
    a, b, c, d, s = sight[0]
    e, f, g, h, t = sight[1]
    p, q, r, o, u = sight[2]
    aa, bb, cc, ee, ff, gg = abs(a), abs(b), abs(c), abs(e), abs(f), abs(g)
    pp, qq, rr = abs(p), abs(q), abs(r)
    for tile in range(len(boxes)):
        some = boxes[tile]  # of one array at constant places: no two are checked for overlap
        for lane in range(_TILE):
            x, y, z = some[lane], some[lane + _TILE], some[lane + 2 * _TILE]
            i, j, k = some[lane + 3 * _TILE], some[lane + 4 * _TILE], some[lane + 5 * _TILE]
            middle, half = a * x + b * y + c * z + d, aa * i + bb * j + cc * k + s
            left, right = _up(middle - half, size), _up(middle + half, size)
            middle, half = e * x + f * y + g * z + h, ee * i + ff * j + gg * k + t
            top, bottom = _up(middle - half, size), _up(middle + half, size)
            middle, half = p * x + q * y + r * z + o, pp * i + qq * j + rr * k + u
            depths[lane], depths[lane + _TILE] = middle - half, middle + half
            place[lane] = _place(left, right, top, bottom, side)
        for lane in range(_TILE):
            limit[lane] = limits[place[lane]]
        for lane in range(min(_TILE, len(kinds) - _TILE * tile)):
            kind = _NEAR if _is_before(depths[lane + _TILE], limit[lane]) else _MIXED
            kinds[_TILE * tile + lane] = _FAR if _is_behind(depths[lane], limit[lane]) else kind


@inner_kernel
def sort_triangles(corners, sight, image, limits, kinds, mixed, near, open_):
    """Fill a bit a triangle, 64 a word: whether it is ``near``; whether it is ``open_``, neither
    near nor far, and spans a centre.

    Four clusters at a time, in loops of their own: what is fetched from memory then leaves the rest
    to vector registers, and waits for no store.  ``mixed`` (clusters + 1,) int32 is scratch.
    """
    side, size = image + 1, np.float32(image)
    depths, place = np.empty(8 * CLUSTER, np.float32), np.empty(4 * CLUSTER, np.int32)
    limit, bits = np.empty(4 * CLUSTER, np.uint32), np.empty(8 * CLUSTER, np.bool_)
    words = bits.view(np.uint64)
    a, b, c, d, dd = sight[0]
    e, f, g, h, hh = sight[1]
    p, q, r, s, ss = sight[2]
    near[:], open_[:] = 0, 0
    count = 0
    for cluster in range(len(kinds)):
        if kinds[cluster] == _NEAR:
            near[cluster // 4] |= np.uint64(0xFFFF) << np.uint64(CLUSTER * (cluster % 4))
        mixed[count] = cluster
        count += kinds[cluster] == _MIXED
    for first in range(0, count, 4):
        there = min(4, count - first)
        for part in range(there):
            some = corners[mixed[first + part]]
            ends, out = depths[CLUSTER * part :], place[CLUSTER * part :]
            for lane in range(CLUSTER):
                x, y, z = some[lane], some[lane + 16], some[lane + 32]
                i, j, k = some[lane + 48], some[lane + 64], some[lane + 80]
                u, v, w = some[lane + 96], some[lane + 112], some[lane + 128]
                m = a * x + b * y + c * z + d
                n = a * i + b * j + c * k + d
                o = a * u + b * v + c * w + d
                left, right = _up(min(min(m, n), o) - dd, size), _up(max(max(m, n), o) + dd, size)
                m = e * x + f * y + g * z + h
                n = e * i + f * j + g * k + h
                o = e * u + f * v + g * w + h
                top, bottom = _up(min(min(m, n), o) - hh, size), _up(max(max(m, n), o) + hh, size)
                m = p * x + q * y + r * z + s
                n = p * i + q * j + r * k + s
                o = p * u + q * v + r * w + s
                ends[lane] = min(min(m, n), o) - ss
                ends[lane + 4 * CLUSTER] = max(max(m, n), o) + ss
                out[lane] = _place(left, right, top, bottom, side)
        for lane in range(CLUSTER * there):
            limit[lane] = limits[place[lane]]
        for lane in range(4 * CLUSTER):
            behind = _is_behind(depths[lane], limit[lane])
            before = ~behind & _is_before(depths[lane + 4 * CLUSTER], limit[lane])
            bits[lane], bits[lane + 4 * CLUSTER] = before, ~(before | behind)
        for part in range(there):
            cluster = mixed[first + part]
            shift = np.uint64(CLUSTER * (cluster % 4))
            near[cluster // 4] |= _packed(words, 2 * part) << shift
            open_[cluster // 4] |= _packed(words, 2 * part + 8) << shift


@inline_kernel
def _packed(words, place):
    """Of sixteen bytes 0 or 1 a bit each, the first the lowest."""
    magic, last = np.uint64(0x0102040810204080), np.uint64(56)
    lower, upper = words[place] * magic >> last, words[place + 1] * magic >> last
    return lower | upper << np.uint64(8)


@inline_kernel
def cluster_pixels(boxes, cluster, sight, image):
    """(left, right, top, bottom) of the pixels whose centres a cluster may cover."""
    box, lane, size = boxes[cluster // _TILE], cluster % _TILE, np.float32(image)
    x, y, z = box[lane], box[lane + _TILE], box[lane + 2 * _TILE]
    i, j, k = box[lane + 3 * _TILE], box[lane + 4 * _TILE], box[lane + 5 * _TILE]
    a, b, c, d, s = sight[0]
    middle, half = a * x + b * y + c * z + d, abs(a) * i + abs(b) * j + abs(c) * k + s
    left, right = _up(middle - half, size), _up(middle + half, size)
    e, f, g, h, t = sight[1]
    middle, half = e * x + f * y + g * z + h, abs(e) * i + abs(f) * j + abs(g) * k + t
    top, bottom = _up(middle - half, size), _up(middle + half, size)
    return np.int64(left), np.int64(right), np.int64(top), np.int64(bottom)
