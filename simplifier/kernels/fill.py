"""Flood fill of a voxel grid, 64 voxels a step.

Free voxels that see the surface on nearly all sides.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compiled.kernel import inline_kernel, kernel


@inline_kernel
def _spread(seed, free):
    """All bits of ``free`` that a run of ones joins to ``seed`` (Kogge-Stone, both ways)."""
    up = seed
    through = free
    down = seed
    back = free
    for step in (1, 2, 4, 8, 16, 32):
        shift = np.uint64(step)
        up |= through & (up << shift)
        through &= through << shift
        down |= back & (down >> shift)
        back &= back >> shift
    return up | down


@kernel("uint64[:, :, :], uint64[:, :, :]")
def flood(free, reached):
    """Grow ``reached`` through ``free`` until nothing changes, 6-connected.

    ``free``, ``reached``  (nx, ny, words) uint64: bit z % 64 of word z // 64 is voxel z.
    ``reached`` holds the seeds at first, a subset of ``free``.

    A queue of words; each is spread along z by shifts, 64 voxels a step, and is visited again only
    when a neighbour brings it new bits.
    """
    nx, ny, words = free.shape
    total = nx * ny * words
    queue = np.empty(total, np.int64)
    queued = np.zeros(total, np.bool_)
    one = np.uint64(1)
    top = np.uint64(63)
    count = 0
    for x in range(nx):
        for y in range(ny):
            for word in range(words):
                if reached[x, y, word] != 0:
                    index = (x * ny + y) * words + word
                    queue[count] = index
                    queued[index] = True
                    count += 1
    head = 0
    while count > 0:
        index = queue[head]
        head = (head + 1) % total
        count -= 1
        queued[index] = False
        x = index // (ny * words)
        y = index // words % ny
        word = index % words
        here = _spread(reached[x, y, word], free[x, y, word])
        reached[x, y, word] = here
        for side in range(6):
            nx_, ny_, nw_ = x, y, word
            carried = here
            if side == 0:
                nx_ = x - 1
            elif side == 1:
                nx_ = x + 1
            elif side == 2:
                ny_ = y - 1
            elif side == 3:
                ny_ = y + 1
            elif side == 4:
                nw_ = word - 1
                carried = (here & one) << top
            else:
                nw_ = word + 1
                carried = here >> top
            if nx_ < 0 or ny_ < 0 or nw_ < 0 or nx_ == nx or ny_ == ny or nw_ == words:
                continue
            news = carried & free[nx_, ny_, nw_] & ~reached[nx_, ny_, nw_]
            if news != 0:
                reached[nx_, ny_, nw_] |= news
                neighbour = (nx_ * ny + ny_) * words + nw_
                if not queued[neighbour]:
                    queued[neighbour] = True
                    queue[(head + count) % total] = neighbour
                    count += 1


_LOW, _HIGH = 7, 56  # bits 0 to 2: touched towards the low end of x, y, z; 3 to 5: the high end


@kernel("bool[:, :, :], int64")
def count_hollow(touched, least):
    """Count the free voxels of ``touched`` (nx, ny, nz) bool that see it on ``least`` of six sides.

    A voxel sees the surface on a side when a touched one lies that way along the axis, at any
    distance.  Two passes over the grid: what a voxel sees is what its neighbour on that side does.
    """
    nx, ny, nz = touched.shape
    seen = np.zeros((nx, ny, nz), np.uint8)
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                bits = _LOW if touched[x, y, z] else 0
                if x > 0:
                    bits |= seen[x - 1, y, z] & 1
                if y > 0:
                    bits |= seen[x, y - 1, z] & 2
                if z > 0:
                    bits |= seen[x, y, z - 1] & 4
                seen[x, y, z] = bits
    count = 0
    for x in range(nx - 1, -1, -1):
        for y in range(ny - 1, -1, -1):
            for z in range(nz - 1, -1, -1):
                bits = seen[x, y, z]
                if touched[x, y, z]:
                    bits |= _HIGH
                if x + 1 < nx:
                    bits |= seen[x + 1, y, z] & 8
                if y + 1 < ny:
                    bits |= seen[x, y + 1, z] & 16
                if z + 1 < nz:
                    bits |= seen[x, y, z + 1] & 32
                seen[x, y, z] = bits
                if not touched[x, y, z] and popcount(np.uint64(bits)) >= least:
                    count += 1
    return count
