"""What an edge of a view cell sees: shadows along rays over a raster of heights.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000): a cull
map from a point of a cell, with the occluders shrunk.  Here a map is made of rays to the pixels of
a square ring around the sample, of half a side R: every pixel inside the ring holds a point of a
ray, a whole number of steps away along one axis, and is less than a pixel from it along either.

Pixels (nx, ny); x and y in pixels.  Heights are codes: whole numbers that grow evenly with heights,
and 0 for none.  A sample stands for a piece of edge that
reaches ``ex`` and ``ey`` to both sides: of a slanted piece the box around it, from which lines pass
a ring wherever they do from the piece.  The occluders are shrunk by that piece and by a pixel.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

FIRST_RING = 256
"""Half a side of the first ring, pixels; each next one is twice as large."""

SHIFT = 2  # of a place, to its square
BLOCK = 1 << SHIFT
"""Pixels along a side of the smallest square that is crossed in one step, and that is one piece of
memory.
"""

TILE = 16
"""Pixels along a side of the smallest tile that is looked at as a whole."""

MASK = BLOCK - 1  # of a place, within its square
ROUNDING = 1e-6  # of a code, and of a share: what rounding may cost is seen


@inline_kernel
def is_free(free, x, y):
    """Whether a pixel lies in one of the boxes (m, 4) in which nothing hides."""
    for box in range(len(free)):
        if free[box, 0] <= x <= free[box, 1] and free[box, 2] <= y <= free[box, 3]:
            return True
    return False


@inline_kernel
def steps_in_shadow(
    x, y, side, step, ring, offset, slant, across, eye, shadow, steepest, blocks
):  # fmt: skip
    """How many steps further a ray only crosses squares that are empty, or in shadow all over.

    These are the steps left along the major axis in the square of a pixel, or 0 where that does not
    hold; the other axis may lead into a second square.
    """
    major = x if side < 2 else y
    left = min(MASK - (major & MASK) if side % 2 == 0 else major & MASK, ring - step)
    if left == 0:
        return 0
    last = np.int64(np.floor(offset + slant * (step + left)))
    if last < 0 or last >= across:
        return 0
    low = shadow if steepest >= 0.0 else shadow + left * steepest
    u, v = (x, last) if side < 2 else (last, y)
    top = max(blocks[x >> SHIFT, y >> SHIFT], blocks[u >> SHIFT, v >> SHIFT])
    return left if top == 0 or top - eye <= low - ROUNDING else 0


@inline_kernel
def rays_of(flat, ring):
    """Of what there is for the rays of the largest ring, (4, 2 ring + 1) for those of one."""
    return flat[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)


@inline_kernel
def next_met(side, slant, ring, sample, highest, pixels, step, took, shadow, steepest):
    """Go on along a ray to the next pixel with something that reaches out of the shadow.

    ``side`` 0 to 3: towards +x, -x, +y, -y, by ``slant`` pixels across for each along.
    ``step`` steps were made, for which ``took`` pixels were looked at; ``shadow`` is over the eye.
    ``highest``  the highest that is looked for; ``sample`` and ``pixels`` as :func:`see_from` takes
    them.  Squares of pixels that are empty, or in shadow all over, are crossed in one step.

    Returns x, y, and ``step``, ``took``, ``shadow`` and ``steepest`` there; x is -1 where there is
    none up to the ring, or up to where all that is looked for is in shadow.  It also is where the
    raster ends first; the steepest is infinite then, since nothing is seen past it.
    """
    (nx, ny), _, _, _, tops, blocks = pixels
    px, py, eye = sample[0], sample[1], sample[2]
    x_major = side < 2
    along, across = (nx, ny) if x_major else (ny, nx)
    sign = 1 if side % 2 == 0 else -1
    begin = np.int64(np.floor(px if x_major else py))
    offset = py if x_major else px
    while step < ring:
        step += 1
        took += 1
        major, minor = begin + sign * step, np.int64(np.floor(offset + slant * step))
        if major < 0 or minor < 0 or major >= along or minor >= across:
            return -1, 0, step, took, shadow, np.inf
        shadow += steepest
        if steepest >= 0.0 and shadow > highest - eye:
            return -1, 0, step, took, shadow, steepest
        x, y = (major, minor) if x_major else (minor, major)
        left = steps_in_shadow(
            x, y, side, step, ring, offset, slant, across, eye, shadow, steepest, blocks
        )  # fmt: skip
        if left > 0:
            step += left
            shadow += left * steepest
            continue
        top = tops[x >> SHIFT, y >> SHIFT, x & MASK, y & MASK]
        if top > 0 and top - eye > shadow - ROUNDING:
            return x, y, step, took, shadow, steepest
    return -1, 0, step, took, shadow, steepest


@inline_kernel
def next_shadow(x, y, step, eye, solid, free, shadow, steepest):
    """The shadow behind a pixel of a ray, over the eye, and the steepest, as height a pixel."""
    height = solid[x >> SHIFT, y >> SHIFT, x & MASK, y & MASK]
    if height > 0 and height - eye > shadow and not is_free(free, x, y):
        return height - eye, (height - eye) / step
    return shadow, steepest


@inner_kernel
def trace(side, index, ring, sample, highest, solid, free, pixels, seen):
    """Follow a ray to the ring; its steepest shadow, as height a pixel, and its steps.

    ``index`` -ring to ring: where on that side.  All else as :func:`next_met` and :func:`see_from`
    take it.
    """
    (_, ny), starts, objects, codes = pixels[:4]
    eye = sample[2]
    steepest = shadow = -np.inf
    step = took = 0
    while True:
        x, y, step, took, shadow, steepest = next_met(
            side, index / ring, ring, sample, highest, pixels, step, took, shadow, steepest
        )
        if x < 0:
            return steepest, took
        place = x * ny + y
        for item in range(starts[place], starts[place + 1]):
            if codes[item] - eye > shadow - ROUNDING:
                seen[objects[item]] = True
        shadow, steepest = next_shadow(x, y, step, eye, solid, free, shadow, steepest)


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
    begin = max(np.int64(np.floor(first - ROUNDING * ring)) - 1, -ring)
    end = min(np.int64(np.floor(last + ROUNDING * ring)) + 1, ring)
    return begin, end, above, below


@inner_kernel
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
        passing = over * (above if over > 0.0 else below) + ROUNDING
        for index in range(begin, end + 1):
            if slopes[side, index + ring] * ring < passing:
                return False
    return True


@inner_kernel
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


@inner_kernel
def see_from(sample, solid, free, pixels, levels, sizes, scratch, seen):
    """Set ``seen`` (n,) bool for what may be seen from a piece of edge; returns steps and tests.

    ``sample``   (6,) float64: x, y, height of the eye, ex, ey, and the highest point of all.
    ``solid``    (bx, by, BLOCK, BLOCK) uint16: up to where the shrunk occluders hide, by squares.
    ``free``     (m, 4) int64: first and last x and y of pixels in which nothing hides.
    ``pixels``   what there is of each pixel beside it:
        shape (nx, ny) of the raster; there may be more pixels in squares, which are empty;
        starts (nx ny + 1,) int32, objects (k,) int32 and codes (k,) uint16: what touches each
        pixel and how high, pixels by rows, as a height field has it;
        tops (bx, by, BLOCK, BLOCK) uint16, by squares: no lower than these objects, nor than what
        is solid; blocks (bx, by) uint16: the highest tops of each square.
    ``levels``   the highest objects of tiles, the finest first, one level after the other, uint16;
                 ``sizes`` (l, 4) int64: where a level begins, its tiles along x and y, and the
                 pixels along a side of a tile.
    ``scratch``  slopes (k,) float64, asked (k,) bool, open tiles (m,) int32: as large as
                 the largest ring needs, and as many as there are tiles.
    """
    px, py, eye, ex, ey, highest = sample
    flat_slopes, flat_asked, waiting = scratch
    nx, ny = pixels[0]
    box = np.empty(4)
    steps = tests = 0
    see_here(px, py, pixels, seen)
    ring = FIRST_RING
    count = -1  # of the tiles that are open; not known at first
    while True:
        slopes, asked = rays_of(flat_slopes, ring), rays_of(flat_asked, ring)
        if count >= 0:
            asked[:] = False
            for index in range(count):
                _set_tile(waiting[index], sizes[0, 2], sizes[0, 3], nx, ny, box)
                ask(box, ring, px, py, ex, ey, asked)
        for side in range(4):
            for index in range(2 * ring + 1):
                if count < 0 or asked[side, index]:
                    slopes[side, index], took = trace(
                        side, index - ring, ring, sample, highest, solid, free, pixels, seen
                    )
                    steps += took
        if count < 0:
            count, took = _open_tiles(sample, ring, slopes, pixels[0], levels, sizes, waiting)
            tests += took
        else:
            kept = 0
            for index in range(count):
                _set_tile(waiting[index], sizes[0, 2], sizes[0, 3], nx, ny, box)
                if reach(box, px, py) > ring:
                    tests += 1
                    top = levels[waiting[index]]
                    if not hides(box, top, ring, px, py, eye, ex, ey, slopes):
                        waiting[kept] = waiting[index]
                        kept += 1
            count = kept
        if count == 0:
            return steps, tests
        ring *= 2


@inline_kernel
def see_here(px, py, pixels, seen):
    """Set ``seen`` for what touches the pixel of a sample, where no ray has made a step yet."""
    (nx, ny), starts, objects = pixels[:3]
    x, y = np.int64(np.floor(px)), np.int64(np.floor(py))
    if 0 <= x < nx and 0 <= y < ny:
        for item in range(starts[x * ny + y], starts[x * ny + y + 1]):
            seen[objects[item]] = True


@inner_kernel
def _open_tiles(sample, ring, slopes, shape, levels, sizes, waiting):
    """The tiles beyond the first ring that are not hidden; from the coarsest level down.

    Returns how many of ``waiting`` they are, and how many were tested.
    """
    px, py, eye, ex, ey, _ = sample
    nx, ny = shape
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
        if top == 0:
            continue
        _set_tile(tile, sizes[level, 2], sizes[level, 3], nx, ny, box)
        if reach(box, px, py) <= ring:
            continue
        tests += 1
        if hides(box, top, ring, px, py, eye, ex, ey, slopes):
            continue
        if level == 0:
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


@kernel(
    "int64, int64, float64[:, :], int64[:], uint16[:, :, :, :], int64[:, :], int64[:], ((int64, "
    "int64), int32[:], int32[:], uint16[:], uint16[:, :, :, :], uint16[:, :]), uint16[:], "
    "int64[:, :], (float64[:], bool[:], int32[:]), bool[:, :], int64[:, :]"
)
def see_from_cells(
    begin, end, samples, sample_starts, solid, free, free_starts, pixels, levels, sizes, scratch,
    seen, work,
):  # fmt: skip
    """Set ``seen`` (c, n) bool of the cells ``begin:end``, each from its samples in turn.

    ``samples`` (s, 6) as :func:`see_from` takes them, those of cell i from ``sample_starts[i]`` on;
    All of them stand for pieces of edge that ``solid`` is shrunk for.
    ``free`` (m, 4) those of cell i from ``free_starts[i]`` on; ``work`` (c, 2) int64 steps, tests.
    """
    for cell in range(begin, end):
        own = free[free_starts[cell] : free_starts[cell + 1]]
        for index in range(sample_starts[cell], sample_starts[cell + 1]):
            steps, tests = see_from(
                samples[index], solid, own, pixels, levels, sizes, scratch, seen[cell]
            )
            work[cell, 0] += steps
            work[cell, 1] += tests
