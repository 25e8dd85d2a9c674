"""Pictures of voxels from far away, from how many sides a free voxel is seen, and who sees it.

A *line of sight* is a frame of twelve numbers: u (3,), v (3,) and d (3,), orthonormal, where d is
the line and u, v span the picture, then the grid's middle (3,).  A pixel is as wide as a voxel; the
middle of the grid lies in the middle of the picture.  A voxel shows in every pixel whose centre its
projection holds, so a surface of voxels has no pinholes.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.kernels.bit_image import lowest_one
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

PHASES = 8
"""Places within a pixel, along u and along v, for which a voxel's outline is worked out."""

FRAME = 12

BLOCK = 1024
"""Candidates that are looked at together: their places and counts stay in the nearest caches."""


@inner_kernel
def fill_outlines(frame, outlines):
    """Fill ``outlines`` (8, 8) int64: the 3 x 3 pixels that a voxel shows in, as bits.

    Of the phase (i, j): the voxel's centre lies ((i + 0.5) / 8, (j + 0.5) / 8) into the pixel in
    the middle.  Its outline grows by what the true centre may be off.
    """
    reach = np.empty(3)
    for i in range(3):
        reach[i] = 0.0
        for j in range(3):
            reach[i] += 0.5 * abs(frame[j] * frame[3 + i] - frame[3 + j] * frame[i])
        # Crossing an edge's direction, (u, v) of a cube's edge, the centre is off by at most this.
        reach[i] += 0.5 / PHASES * (abs(frame[i]) + abs(frame[3 + i]))
    for row in range(PHASES):
        for column in range(PHASES):
            bits = 0
            for pixel in range(9):
                x = pixel // 3 - 0.5 - (row + 0.5) / PHASES
                y = pixel % 3 - 0.5 - (column + 0.5) / PHASES
                shows = True
                for i in range(3):
                    shows = shows and abs(x * frame[3 + i] - y * frame[i]) <= reach[i]
                if shows:
                    bits |= 1 << pixel
            outlines[row, column] = bits


@inner_kernel
def list_offsets(outlines, width, counts, offsets):
    """Of each outline (8, 8): how many pixels, ``counts`` (64,) int64, and where they lie from the
    one in the middle in a picture so wide, ``offsets`` (64, 9) int64."""
    for phase in range(PHASES * PHASES):
        bits = outlines[phase // PHASES, phase % PHASES]
        count = 0
        for pixel in range(9):
            if bits >> pixel & 1:
                offsets[phase, count] = (pixel // 3 - 1) * width + pixel % 3 - 1
                count += 1
        counts[phase] = count


@inner_kernel
def _place(voxels, first, count, frame, size, middles, phases, depths):
    """Where ``count`` voxels from ``first`` on lie in a picture of ``size``: the pixel of their
    centre, which of the 64 phases that is, and their depth.  Apart from the picture, so that it
    runs eight at a time."""
    half = 0.5 * size
    f0, f1, f2, f3, f4, f5, f6, f7, f8, m0, m1, m2 = frame
    xs, ys, zs = voxels[0, first:], voxels[1, first:], voxels[2, first:]
    for one in range(count):
        x, y, z = xs[one] + 0.5 - m0, ys[one] + 0.5 - m1, zs[one] + 0.5 - m2
        u = f0 * x + f1 * y + f2 * z + half
        v = f3 * x + f4 * y + f5 * z + half
        depths[one] = f6 * x + f7 * y + f8 * z
        row, column = np.int32(u), np.int32(v)
        middles[one] = row * size + column
        phases[one] = np.int32((u - row) * PHASES) * PHASES + np.int32((v - column) * PHASES)


@inline_kernel
def _show(picture, middle, depth, count, offsets):
    """Draw a voxel: ``count`` pixels, so far from the one with its centre."""
    for offset in range(count):
        pixel = np.uint64(middle + offsets[offset])
        picture[pixel, 0] = min(picture[pixel, 0], depth)
        picture[pixel, 1] = max(picture[pixel, 1], depth)


@kernel("int16[:, :], float64[:, :], int64, int64, float32[:, :, :, :]")
def draw_voxels(voxels, frames, begin, end, depths):
    """Draw the lines of sight ``begin`` to ``end``: depths of the nearest and the farthest voxel.

    ``voxels``  (3, n) int16: i, j, k of each, whose centre is half a voxel further on.
    ``frames``  (a, 12) float64.
    ``depths``  (a or more, s, s, 2) float32: nearest and farthest, voxels along d; infinite where
                nothing is.  The two lie side by side, as both are written and read at once.
    """
    size = depths.shape[1]
    outlines = np.empty((PHASES, PHASES), np.int64)
    counts = np.empty(PHASES * PHASES, np.int64)
    offsets = np.empty((PHASES * PHASES, 9), np.int64)
    middles, phases = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    own = np.empty(BLOCK, np.float32)
    for line in range(begin, end):
        fill_outlines(frames[line], outlines)
        list_offsets(outlines, size, counts, offsets)
        picture = depths[line].reshape(-1, 2)
        for pixel in range(len(picture)):
            picture[pixel, 0] = np.inf
            picture[pixel, 1] = -np.inf
        for first in range(0, voxels.shape[1], BLOCK):
            there = min(BLOCK, voxels.shape[1] - first)
            _place(voxels, first, there, frames[line], size, middles, phases, own)
            for one in range(there):
                _show(picture, middles[one], own[one], counts[phases[one]], offsets[phases[one]])


@kernel("int16[:, :], int16[:, :], float64[:, :], uint8[:, :], int64, int64, int64, uint8[:, :]")
def count_few(voxels, places, frames, senses, size, begin, end, sides):
    """Find from how many sides each of a few candidates is seen in the lines ``begin`` to ``end``.

    ``voxels``, ``frames`` as for :func:`draw_voxels`, ``senses`` as for :func:`count_sight`.
    ``places``  (3, n) int16 candidates.
    ``size``    pixels a side of a picture.
    ``sides``   (a, n) uint8, filled: 0 to 2 a line.

    A picture is drawn only where a candidate lies, and looked at before the next one is.
    """
    outlines = np.empty((PHASES, PHASES), np.int64)
    counts = np.empty(PHASES * PHASES, np.int64)
    offsets = np.empty((PHASES * PHASES, 9), np.int64)
    middles, phases = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    own, few = np.empty(BLOCK, np.float32), places.shape[1]
    pixels, unused, depths = np.empty(few, np.int32), np.empty(few, np.int32), np.empty(few)
    nearby = np.empty(BLOCK + 1, np.int64)
    picture = np.empty((size * size, 2), np.float32)
    needed = np.zeros(size * size, np.bool_)
    for line in range(begin, end):
        fill_outlines(frames[line], outlines)
        list_offsets(outlines, size, counts, offsets)
        _place(places, 0, few, frames[line], size, pixels, unused, depths)
        for one in range(few):
            pixel = np.int64(pixels[one])
            picture[pixel, 0] = np.inf
            picture[pixel, 1] = -np.inf
            _set_around(needed, pixel, size, True)
        for first in range(0, voxels.shape[1], BLOCK):
            there = min(BLOCK, voxels.shape[1] - first)
            _place(voxels, first, there, frames[line], size, middles, phases, own)
            kept = 0
            for one in range(there):  # a list first: a processor guesses half of these wrong
                nearby[kept] = one
                kept += np.int64(needed[np.uint64(middles[one])])
            for number in range(kept):
                one = nearby[number]
                _show(picture, middles[one], own[one], counts[phases[one]], offsets[phases[one]])
        along, against = np.int64(senses[line, 0]), np.int64(senses[line, 1])
        for one in range(few):
            pixel = np.int64(pixels[one])
            sides[line, one] = along * (picture[pixel, 0] >= depths[one]) + against * (
                picture[pixel, 1] <= depths[one]
            )
            _set_around(needed, pixel, size, False)


@inline_kernel
def _set_around(needed, pixel, size, value):
    """Of a pixel and the eight around it: a voxel whose centre lies elsewhere does not show in
    that pixel."""
    for near in range(pixel - size, pixel + size + 1, size):
        needed[near - 1], needed[near], needed[near + 1] = value, value, value


@kernel("uint64[:, :, :], int64[:], int64, int64, int16[:, :]")
def list_voxels(words, firsts, begin, end, places):
    """Fill ``places`` (n, 3) int16 with the voxels that are set, in order, from the layers
    ``begin:end``; those of layer i begin at ``firsts[i]``.

    ``words``  (nx, ny, nw) uint64: bit z % 64 of word z // 64 is voxel z.
    """
    for i in range(begin, end):
        place = firsts[i]
        for j in range(words.shape[1]):
            for word in range(words.shape[2]):
                left = words[i, j, word]
                while left != 0:
                    lowest, bit = lowest_one(left)
                    left ^= lowest
                    places[place, 0], places[place, 1] = i, j
                    places[place, 2] = 64 * word + bit
                    place += 1


@kernel("int16[:, :], int64[:], uint64[:, :, :]")
def set_voxels(places, live, words):
    """Set the candidates that are left, as :func:`count_sight` leaves them, in ``words`` as of
    :func:`list_voxels`."""
    for block in range(len(live)):
        for one in range(block * BLOCK, block * BLOCK + live[block]):
            x, y, z = places[one, 0], places[one, 1], places[one, 2]
            words[x, y, z // 64] |= np.uint64(1) << np.uint64(z % 64)


@kernel(
    "int16[:, :], float64[:, :], uint8[:, :], float32[:, :, :, :], int64, int64, int64, "
    "uint16[:], int64[:]"
)
def count_sight(places, frames, senses, depths, limit, begin, end, seen, live):
    """Add to ``seen`` from how many sides each candidate of the blocks ``begin:end`` is seen.

    ``places``  (n, 3) int16 free voxels, and ``seen`` (n,) uint16; a block is 1024 of them.  Those
                that are seen from more sides than ``limit`` are taken out: the others move to the
                front of their block.
    ``senses``  (a, 2) uint8: whether someone looks along d, and against it.
    ``depths``  as :func:`draw_voxels` gives.
    ``live``    (blocks,) int64: how many of each block are left.
    """
    size = depths.shape[1]
    half, width = 0.5 * size, np.int32(size)
    xs, ys, zs = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    own, pixels = np.empty(BLOCK), np.empty(BLOCK, np.int32)
    near, far = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    sides = np.empty(BLOCK, np.int32)
    for block in range(begin, end):
        first, count = block * BLOCK, live[block]
        for one in range(count):
            xs[one] = places[first + one, 0] + 0.5 - frames[0, 9]
            ys[one] = places[first + one, 1] + 0.5 - frames[0, 10]
            zs[one] = places[first + one, 2] + 0.5 - frames[0, 11]
            sides[one] = seen[first + one]
        for line in range(len(frames)):
            picture = depths[line].reshape(-1, 2)
            along, against = np.int32(senses[line, 0]), np.int32(senses[line, 1])
            f0, f1, f2 = frames[line, 0], frames[line, 1], frames[line, 2]
            f3, f4, f5 = frames[line, 3], frames[line, 4], frames[line, 5]
            f6, f7, f8 = frames[line, 6], frames[line, 7], frames[line, 8]
            for one in range(count):  # apart from the pictures, so that it runs eight at a time
                x, y, z = xs[one], ys[one], zs[one]
                u = f0 * x + f1 * y + f2 * z + half
                v = f3 * x + f4 * y + f5 * z + half
                own[one] = f6 * x + f7 * y + f8 * z
                pixels[one] = np.int32(u) * width + np.int32(v)
            for one in range(count):
                pixel = np.uint64(pixels[one])
                near[one], far[one] = picture[pixel, 0], picture[pixel, 1]
            for one in range(count):
                sides[one] += along * np.int32(near[one] >= own[one])
                sides[one] += against * np.int32(far[one] <= own[one])
        kept = 0
        for one in range(count):
            if sides[one] <= limit:
                for axis in range(3):
                    places[first + kept, axis] = places[first + one, axis]
                seen[first + kept] = sides[one]
                kept += 1
        live[block] = kept


def picture_size(shape: tuple[int, int, int]) -> int:
    """Pixels a side of a picture that holds the grid from all sides, and a pixel around it."""
    return math.ceil(math.sqrt(sum(float(length) ** 2 for length in shape))) + 4


@inline_kernel
def _sees(eye, i, j, k, touched):
    """Whether nothing touched lies between an eye and the centre of a free voxel.

    Voxel after voxel along the line, in the way of Amanatides and Woo, "A Fast Voxel Traversal
    Algorithm for Ray Tracing" (1987).  Beyond the grid all is free.
    """
    at = np.array([i, j, k])
    last = np.empty(3, np.int64)
    step = np.empty(3, np.int64)
    upcoming = np.empty(3)  # share of the line at the next voxel's face, axis by axis
    share = np.empty(3)  # of the line across a voxel
    for axis in range(3):
        run = eye[axis] - (at[axis] + 0.5)
        last[axis] = np.int64(math.floor(eye[axis]))
        step[axis] = 1 if run > 0.0 else -1
        share[axis] = 1.0 / abs(run) if run != 0.0 else np.inf
        upcoming[axis] = 0.5 * share[axis]
    while at[0] != last[0] or at[1] != last[1] or at[2] != last[2]:
        axis = 0
        if upcoming[1] < upcoming[axis]:
            axis = 1
        if upcoming[2] < upcoming[axis]:
            axis = 2
        if upcoming[axis] >= 1.0:  # rounding put the eye in the voxel before
            return True
        at[axis] += step[axis]
        upcoming[axis] += share[axis]
        if at[axis] < 0 or at[axis] >= touched.shape[axis]:
            return True
        arrived = at[0] == last[0] and at[1] == last[1] and at[2] == last[2]
        if touched[at[0], at[1], at[2]] and not arrived:
            return False
    return True


@kernel("bool[:, :, :], bool[:, :, :], float64[:, :], int64, int64, bool[:, :, :]")
def mark_seen(touched, candidates, eyes, begin, end, seen):
    """Set ``seen`` in the candidates of the layers ``begin:end`` that one of the eyes sees.

    ``touched``, ``candidates``, ``seen``  (nx, ny, nz) bool.
    ``eyes``  (n, 3) float64, grid space; the first that is asked is who saw the voxel before.
    """
    count, lucky = len(eyes), 0
    for i in range(begin, end):
        for j in range(touched.shape[1]):
            for k in range(touched.shape[2]):
                if not candidates[i, j, k]:
                    continue
                for turn in range(count):
                    index = (lucky + turn) % count
                    if _sees(eyes[index], i, j, k, touched):
                        seen[i, j, k] = True
                        lucky = index
                        break
