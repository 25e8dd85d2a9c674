"""Pictures of voxels from far away, from how many sides a free voxel is seen, and who sees it.

A *line of sight* is a frame of twelve numbers: u (3,), v (3,) and d (3,), orthonormal, where d is
the line and u, v span the picture, then the grid's middle (3,).  A pixel is as wide as a voxel; the
middle of the grid lies in the middle of the picture.  A voxel shows in every pixel whose centre its
projection holds, so a surface of voxels has no pinholes.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel

PHASES = 8
"""Places within a pixel, along u and along v, for which a voxel's outline is worked out."""

FRAME = 12


@kernel
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


@kernel
def draw_voxels(voxels, frames, begin, end, near, far):
    """Draw the lines of sight ``begin`` to ``end``: depths of the nearest and the farthest voxel.

    ``voxels``  (n, 3) int32, voxel (i, j, k) with its centre half a voxel further on.
    ``frames``  (a, 12) float64.
    ``near``, ``far``  (a or more, s, s) float32, voxels along d; infinite where nothing is.
    """
    size = near.shape[1]
    half = 0.5 * size
    outlines = np.empty((PHASES, PHASES), np.int64)
    for line in range(begin, end):
        frame = frames[line]
        fill_outlines(frame, outlines)
        front, back = near[line], far[line]
        front[:] = np.inf
        back[:] = -np.inf
        for index in range(len(voxels)):
            x = voxels[index, 0] + 0.5 - frame[9]
            y = voxels[index, 1] + 0.5 - frame[10]
            z = voxels[index, 2] + 0.5 - frame[11]
            u = frame[0] * x + frame[1] * y + frame[2] * z + half
            v = frame[3] * x + frame[4] * y + frame[5] * z + half
            depth = np.float32(frame[6] * x + frame[7] * y + frame[8] * z)
            row, column = np.int64(u), np.int64(v)
            bits = outlines[np.int64((u - row) * PHASES), np.int64((v - column) * PHASES)]
            for pixel in range(9):
                if bits >> pixel & 1:
                    r, c = row - 1 + pixel // 3, column - 1 + pixel % 3
                    front[r, c] = min(front[r, c], depth)
                    back[r, c] = max(back[r, c], depth)


@inline_kernel
def _ends(frame, x, y, z, half, near, far):
    """(nearest, farthest, own) depth where a voxel's centre shows."""
    u = frame[0] * x + frame[1] * y + frame[2] * z + half
    v = frame[3] * x + frame[4] * y + frame[5] * z + half
    own = frame[6] * x + frame[7] * y + frame[8] * z
    row, column = np.int64(u), np.int64(v)
    return near[row, column], far[row, column], own


@kernel
def count_sight(free, frames, senses, near, far, limit, begin, end, seen):
    """Add to ``seen`` from how many sides each free voxel of the layers ``begin:end`` is seen.

    ``free``    (nx, ny, nz) bool.
    ``senses``  (a, 2) uint8: whether someone looks along d, and against it.
    ``limit``   voxels that are seen from more sides than this are left alone.
    ``seen``    (nx, ny, nz) uint16.
    """
    half = 0.5 * near.shape[1]
    middle = frames[0, 9:]
    for i in range(begin, end):
        for j in range(free.shape[1]):
            for k in range(free.shape[2]):
                if not free[i, j, k] or seen[i, j, k] > limit:
                    continue
                x, y, z = i + 0.5 - middle[0], j + 0.5 - middle[1], k + 0.5 - middle[2]
                sides = 0
                for line in range(len(frames)):
                    first, last, own = _ends(frames[line], x, y, z, half, near[line], far[line])
                    sides += senses[line, 0] * (first >= own) + senses[line, 1] * (last <= own)
                seen[i, j, k] += sides


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


@kernel
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
