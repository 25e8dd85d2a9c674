"""What an edge of a view cell sees: shadows along rays over a raster of heights.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000): a cull
map from a point of a cell, with the occluders shrunk.  Here a map is made of rays to the pixels of
a square ring around the sample, of half a side R: every pixel inside the ring holds a point of a
ray, a whole number of steps away along one axis, and is less than a pixel from it along either.

Pixels (nx, ny); x and y in pixels, heights as they are.  A sample stands for a piece of edge that
reaches ``ex`` and ``ey`` to both sides: of a slanted piece the box around it, from which lines pass
a ring wherever they do from the piece.  The occluders are shrunk by that piece and by a pixel.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import inline_kernel, kernel

FIRST_RING = 256
"""Half a side of the first ring, pixels; each next one is twice as large."""

BLOCK = 4
"""Pixels along a side of the smallest square that is crossed in one step."""

LEAF = 2
"""The level of squares, each twice as large as the one before, that are looked at as a whole."""

_ROUNDING = 1e-9  # of a height, and of a share: what rounding may cost is seen


@inline_kernel
def is_free(free, x, y):
    """Whether a pixel lies in one of the boxes (m, 4) in which nothing hides."""
    for box in range(len(free)):
        if free[box, 0] <= x <= free[box, 1] and free[box, 2] <= y <= free[box, 3]:
            return True
    return False


@kernel
def trace(
    side, index, ring, px, py, eye, highest, pairs, turned, free, field, blocks, blocks_y, seen
):  # fmt: skip
    """Follow a ray to the ring; its steepest shadow, as height a pixel, and its steps.

    ``side`` 0 to 3: towards +x, -x, +y, -y; ``index`` -ring to ring: where on that side.
    Blocks of pixels that are empty, or in shadow all over, are crossed in one step.
    """
    starts, objects, tops = field
    x_major = side < 2
    grid = turned if x_major else pairs  # whose rows lie along the ray
    across, along = grid.shape[:2]
    sign = 1 if side % 2 == 0 else -1
    slant = index / ring
    begin = np.int64(np.floor(px if x_major else py))
    offset = py if x_major else px
    steepest = -np.inf
    shadow = -np.inf
    step = took = 0
    while step < ring:
        step += 1
        took += 1
        major, minor = begin + sign * step, np.int64(np.floor(offset + slant * step))
        if major < 0 or minor < 0 or major >= along or minor >= across:
            return np.inf, took
        shadow += steepest
        if steepest >= 0.0 and shadow > highest:
            return steepest, took
        # Steps left in the block along the major axis; the other may lead into a second one.
        left = BLOCK - 1 - major % BLOCK if sign > 0 else major % BLOCK
        left = min(left, ring - step)
        if left > 0:
            last = np.int64(np.floor(offset + slant * (step + left)))
            if 0 <= last < across:
                low = shadow if steepest >= 0.0 else shadow + left * steepest
                if x_major:
                    one = blocks[major // BLOCK * blocks_y + minor // BLOCK]
                    two = blocks[major // BLOCK * blocks_y + last // BLOCK]
                else:
                    one = blocks[minor // BLOCK * blocks_y + major // BLOCK]
                    two = blocks[last // BLOCK * blocks_y + major // BLOCK]
                top = max(one, two)
                if top == -np.inf or top - eye <= low - _ROUNDING:
                    step += left
                    shadow += left * steepest
                    continue
        if grid[minor, major, 1] - eye > shadow - _ROUNDING:
            place = major * across + minor if x_major else minor * along + major
            for item in range(starts[place], starts[place + 1]):
                if tops[item] - eye > shadow - _ROUNDING:
                    seen[objects[item]] = True
        height = grid[minor, major, 0] - eye
        if height > shadow:
            x, y = (major, minor) if x_major else (minor, major)
            if not is_free(free, x, y):
                shadow = height
                steepest = height / step
    return steepest, took


@inline_kernel
def _passage(side, box, ring, px, py, ex, ey):
    """Where lines to a box cross a side of the ring, seen from any point of the piece of edge.

    Returns the first and the last index, first > last where none does, and by what a height over
    the eye is multiplied at the ring, if it is above the eye and if it is below.
    """
    if side < 2:
        near, far, low, high = box[0] - px, box[1] - px, box[2] - py, box[3] - py
        along, across = ex, ey
    else:
        near, far, low, high = box[2] - py, box[3] - py, box[0] - px, box[1] - px
        along, across = ey, ex
    if side % 2 == 1:
        near, far = -far, -near
    if far <= ring:
        return 1, 0, 0.0, 0.0
    near = max(near, float(ring))
    above = (ring + along) / (near + along)
    below = (ring - along) / (far - along)
    first = min(low * above, low * below) - across
    last = max(high * above, high * below) + across
    if first > ring + 1.0 or last < -ring - 1.0:
        return 1, 0, 0.0, 0.0
    begin = max(np.int64(np.floor(first - _ROUNDING * ring)) - 1, -ring)
    end = min(np.int64(np.floor(last + _ROUNDING * ring)) + 1, ring)
    return begin, end, above, below


@kernel
def hides(box, top, ring, px, py, eye, ex, ey, slopes):
    """Whether all lines to a box pass below the shadows at the ring.

    ``box`` from low to high x and y, with no point within the ring; ``slopes`` (4, 2 ring + 1).
    A line to what lies behind the ring passes one of its pixels, and what is seen of that from the
    piece of edge is above the shadow there.
    """
    over = top - eye
    for side in range(4):
        begin, end, above, below = _passage(side, box, ring, px, py, ex, ey)
        if begin > end:
            continue
        passing = over * (above if over > 0.0 else below) + _ROUNDING
        for index in range(begin, end + 1):
            if slopes[side, index + ring] * ring < passing:
                return False
    return True


@kernel
def ask(box, ring, px, py, ex, ey, asked):
    """Ask for the rays that visit a box, or pass below it at the ring."""
    for side in range(4):
        begin, end, _, _ = _passage(side, box, ring, px, py, ex, ey)
        for index in range(begin, end + 1):
            asked[side, index + ring] = True
        if side < 2:
            near, far, low, high = box[0] - px, box[1] - px, box[2] - py, box[3] - py
        else:
            near, far, low, high = box[2] - py, box[3] - py, box[0] - px, box[1] - px
        if side % 2 == 1:
            near, far = -far, -near
        near, far = max(near - 1.0, 1.0), min(far + 1.0, float(ring))
        if far < 1.0 or near > far:
            continue
        first = min((low - 1.0) / near, (low - 1.0) / far) * ring
        last = max((high + 1.0) / near, (high + 1.0) / far) * ring
        for index in range(max(np.int64(first) - 1, -ring), min(np.int64(last) + 1, ring) + 1):
            asked[side, index + ring] = True


@inline_kernel
def reach(box, px, py):
    """How far the furthest point of a box is, by the longer axis."""
    return max(box[1] - px, px - box[0], box[3] - py, py - box[2])


@inline_kernel
def _set_tile(tile, tiles_y, size, nx, ny, box):
    """The box of a tile of so many pixels a side, by its number."""
    x, y = tile // tiles_y * size, tile % tiles_y * size
    box[0], box[1] = float(x), float(min(x + size, nx))
    box[2], box[3] = float(y), float(min(y + size, ny))


@kernel
def see_from(sample, pairs, turned, free, field, levels, sizes, scratch, seen):
    """Set ``seen`` (n,) bool for what may be seen from a piece of edge; returns steps and tests.

    ``sample``   (6,) float64: x, y, height of the eye, ex, ey, and the highest point of all.
    ``pairs``    (nx, ny, 2) float32: of each pixel the height of the shrunk occluders, and that of
                 the highest object; ``turned`` (ny, nx, 2) the same.
    ``free``     (m, 4) int64: first and last x and y of pixels in which nothing hides.
    ``field``    starts, objects, tops: what touches each pixel, as a height field has it.
    ``levels``   the highest objects of tiles, the finest first, one level after the other, float32;
                 ``sizes`` (l, 4) int64: where a level begins, its tiles along x and y, and the
                 pixels along a side of a tile.
    ``scratch``  slopes (k,) float64, asked (k,) bool, open tiles (m,) int32: as large as
                 the largest ring needs, and as many as there are tiles.
    """
    px, py, eye, ex, ey, highest = sample
    flat_slopes, flat_asked, waiting = scratch
    nx, ny = pairs.shape[:2]
    box = np.empty(4)
    steps = tests = 0
    ix, iy = np.int64(np.floor(px)), np.int64(np.floor(py))
    if 0 <= ix < nx and 0 <= iy < ny:  # where no ray has made a step yet
        for item in range(field[0][ix * ny + iy], field[0][ix * ny + iy + 1]):
            seen[field[1][item]] = True
    ring = FIRST_RING
    count = -1  # of the tiles that are open; not known at first
    while True:
        slopes = flat_slopes[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        asked = flat_asked[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        if count >= 0:
            asked[:] = False
            for index in range(count):
                _set_tile(waiting[index], sizes[LEAF, 2], sizes[LEAF, 3], nx, ny, box)
                ask(box, ring, px, py, ex, ey, asked)
        for side in range(4):
            for index in range(2 * ring + 1):
                if count < 0 or asked[side, index]:
                    slope, took = trace(
                        side, index - ring, ring, px, py, eye, highest - eye, pairs, turned, free,
                        field, levels, sizes[0, 2], seen,
                    )  # fmt: skip
                    slopes[side, index] = slope
                    steps += took
        if count < 0:
            count, took = _open_tiles(sample, ring, slopes, pairs, levels, sizes, waiting)
            tests += took
        else:
            kept = 0
            for index in range(count):
                _set_tile(waiting[index], sizes[LEAF, 2], sizes[LEAF, 3], nx, ny, box)
                if reach(box, px, py) > ring:
                    tests += 1
                    top = levels[sizes[LEAF, 0] + waiting[index]]
                    if not hides(box, top, ring, px, py, eye, ex, ey, slopes):
                        waiting[kept] = waiting[index]
                        kept += 1
            count = kept
        if count == 0:
            return steps, tests
        ring *= 2


@kernel
def _open_tiles(sample, ring, slopes, pairs, levels, sizes, waiting):
    """The tiles beyond the first ring that are not hidden; from the coarsest level down.

    Returns how many of ``waiting`` they are, and how many were tested.
    """
    px, py, eye, ex, ey, _ = sample
    nx, ny = pairs.shape[:2]
    box = np.empty(4)
    # Tiles that are still to be looked at, as level and number: four from each at most.
    stack = np.empty((4 * len(sizes) + sizes[-1, 1] * sizes[-1, 2], 2), np.int64)
    depth = 0
    for tile in range(sizes[-1, 1] * sizes[-1, 2]):
        stack[depth, 0], stack[depth, 1] = len(sizes) - 1, tile
        depth += 1
    count = tests = 0
    while depth > 0:
        depth -= 1
        level, tile = stack[depth]
        top = levels[sizes[level, 0] + tile]
        if top == -np.inf:
            continue
        _set_tile(tile, sizes[level, 2], sizes[level, 3], nx, ny, box)
        if reach(box, px, py) <= ring:
            continue
        tests += 1
        if hides(box, top, ring, px, py, eye, ex, ey, slopes):
            continue
        if level == LEAF:
            waiting[count] = tile
            count += 1
            continue
        x, y = tile // sizes[level, 2], tile % sizes[level, 2]
        for child in range(4):
            cx, cy = 2 * x + child // 2, 2 * y + child % 2
            if cx < sizes[level - 1, 1] and cy < sizes[level - 1, 2]:
                stack[depth, 0], stack[depth, 1] = level - 1, cx * sizes[level - 1, 2] + cy
                depth += 1
    return count, tests


@kernel
def see_from_cells(
    begin, end, samples, sample_starts, pairs, turned, free, free_starts, field, levels, sizes,
    scratch, seen, work,
):  # fmt: skip
    """Set ``seen`` (c, n) bool of the cells ``begin:end``, each from its samples in turn.

    ``samples`` (s, 6) as :func:`see_from` takes them, those of cell i from ``sample_starts[i]`` on;
    All of them stand for pieces of edge that ``pairs`` and ``turned`` are shrunk for.
    ``free`` (m, 4) those of cell i from ``free_starts[i]`` on; ``work`` (c, 2) int64 steps, tests.
    """
    for cell in range(begin, end):
        own = free[free_starts[cell] : free_starts[cell + 1]]
        for index in range(sample_starts[cell], sample_starts[cell + 1]):
            steps, tests = see_from(
                samples[index], pairs, turned, own, field, levels, sizes, scratch, seen[cell]
            )
            work[cell, 0] += steps
            work[cell, 1] += tests
