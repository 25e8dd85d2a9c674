"""How high up each part of some objects is hidden from an edge of a view cell.

Yilmaz and Gudukbay, "Conservative occlusion culling for urban visualization using a slice-wise data
structure" (2007), algorithms 2 and 3.  An object's box is cut into as many slices along each axis,
so that its plan has as many times as many *parts*.  Rays towards it, as those of ``close_look.py``,
tell up to where each part is hidden.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.close_look import ask_towards, keep_open
from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel
from simplifier.kernels.cull_map import FIRST_RING, next_met, next_shadow, rays_of
from simplifier.kernels.cull_map import ROUNDING as _CODE

_ROUNDING = 1e-9  # of a height, and of a slice: what rounding may cost is seen


@inline_kernel
def _slices_over(low, scale, pixel, slices):
    """The first and the last slice that a pixel touches; all of a box that has no width."""
    if scale == 0.0:
        return 0, slices - 1
    first = np.int64(np.floor((pixel - low) * scale - _ROUNDING))
    last = np.int64(np.floor((pixel + 1.0 - low) * scale + _ROUNDING))
    return min(max(first, 0), slices - 1), max(min(last, slices - 1), 0)


@inner_kernel
def _lower_parts(x, y, height, frame, parts):
    """Lower the parts (s, s) of an object that a pixel touches to a hidden height."""
    first_x, last_x = _slices_over(frame[0], frame[1], x, len(parts))
    first_y, last_y = _slices_over(frame[2], frame[3], y, len(parts))
    for i in range(first_x, last_x + 1):
        for j in range(first_y, last_y + 1):
            parts[i, j] = min(parts[i, j], height)


@inner_kernel
def _lower_along(side, index, ring, sample, highest, solid, free, pixels, frames, places, parts):
    """Follow a ray as :func:`~simplifier.kernels.cull_map.trace` does; the steepest shadow, steps.

    ``parts`` (k, s, s) of objects with ``places`` (n,) int32 in it, -1 for all others,
    are lowered to the shadow in pixels where they reach out of it.
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
            own = places[objects[item]]
            if own >= 0 and codes[item] - eye > shadow - _CODE:
                _lower_parts(x, y, eye + shadow, frames[own], parts[own])
        shadow, steepest = next_shadow(x, y, step, eye, solid, free, shadow, steepest)


@inner_kernel
def _lower_from(
    sample, solid, free, pixels, boxes, tops, scratch, wanted, frames, places, parts
):  # fmt: skip
    """Lower the parts of the objects ``wanted`` (k,) int64 to the shadows from a piece of edge.

    Returns steps of rays, and tests of objects against a ring.
    """
    px, py = sample[0], sample[1]
    flat_slopes, flat_asked, waiting, _ = scratch
    (nx, ny), starts, objects = pixels[0], pixels[1], pixels[2]
    steps = tests = count = 0
    ix, iy = np.int64(np.floor(px)), np.int64(np.floor(py))
    if 0 <= ix < nx and 0 <= iy < ny:  # where no ray has made a step yet
        for item in range(starts[ix * ny + iy], starts[ix * ny + iy + 1]):
            own = places[objects[item]]
            if own >= 0:
                _lower_parts(ix, iy, -np.inf, frames[own], parts[own])
    for own in range(len(wanted)):
        if parts[own].max() >= frames[own, 4]:  # of others no slice is hidden any more
            waiting[count] = wanted[own]
            count += 1
    ring = FIRST_RING
    while count > 0:
        slopes, asked = rays_of(flat_slopes, ring), rays_of(flat_asked, ring)
        highest = ask_towards(sample, ring, boxes, tops, waiting[:count], asked)
        for side in range(4):
            for index in range(2 * ring + 1):
                if asked[side, index]:
                    slope, took = _lower_along(
                        side, index - ring, ring, sample, highest, solid, free, pixels, frames,
                        places, parts,
                    )  # fmt: skip
                    slopes[side, index] = slope
                    steps += took
        count, took = keep_open(sample, ring, boxes, tops, slopes, waiting[:count])
        tests += took
        ring *= 2
    return steps, tests


@kernel(
    "int64, int64, float64[:, :], int64[:], uint16[:, :, :, :], int64[:, :], int64[:], ((int64, "
    "int64), int32[:], int32[:], uint16[:], uint16[:, :, :, :], uint16[:, :]), float64[:, :], "
    "uint16[:], (float64[:], bool[:], int32[:], int32[:]), int64[:], int64[:], float64[:, :], "
    "float64[:, :, :], int64[:, :]"
)
def lower_from_cells(
    begin, end, samples, sample_starts, solid, free, free_starts, pixels, boxes, tops, scratch,
    wanted, wanted_starts, frames, parts, work,
):  # fmt: skip
    """Lower ``parts`` (k, s, s) float64, places among the codes, to up to where they are hidden
    from all samples.

    What no ray reaches out of a shadow stays as it is: it is hidden as a whole.  For the cells
    ``begin:end``, as :func:`~simplifier.kernels.close_look.look_from_cells` takes them.

    ``wanted``   (k,) int64: the objects of cell i from ``wanted_starts[i]`` on.
    ``frames``   (k, 5) float64: low x of the object in pixels, slices a pixel along x, or 0 where
                 it has no width, the same along y, and the top of its lowest slice as a place.
    ``scratch``  as ``look_for`` takes it, and (n,) int32 of -1, which is left as it was.
    """
    places = scratch[3]
    for cell in range(begin, end):
        first, last = wanted_starts[cell], wanted_starts[cell + 1]
        own = wanted[first:last]
        for index in range(len(own)):
            places[own[index]] = index
        open_pixels = free[free_starts[cell] : free_starts[cell + 1]]
        for index in range(sample_starts[cell], sample_starts[cell + 1]):
            steps, tests = _lower_from(
                samples[index], solid, open_pixels, pixels, boxes, tops, scratch, own,
                frames[first:last], places, parts[first:last],
            )  # fmt: skip
            work[cell, 0] += steps
            work[cell, 1] += tests
        for index in range(len(own)):
            places[own[index]] = -1


@kernel("int64, int64, float64[:, :, :], float64[:], float64[:], float64[:, :], int8[:, :]")
def hidden_blocks(begin, end, parts, lows, heights, sizes, blocks):
    """Set ``blocks`` (k, 3) int8 of the objects ``begin:end`` to the largest hidden block of each.

    Algorithm 3 of the paper: of all blocks at a lower corner of the box that are hidden as a whole.
    Here a block may end along both axes of the plan.  Along these the slices are hidden above
    the k lowest for k > 0, or the -k lowest, or all for 0; then the number of slices from below.
    A block of no height is 0 along all three.  Of equal ones the first counts, with more along x,
    then y, and at the low sides.

    ``parts``    (k, s, s) float64: up to where each part is hidden.
    ``lows``, ``heights``  (k,) float64 of the objects.
    ``sizes``    (k, 2) float64: along x and y; blocks are compared by the area of the faces
                 of the object's box but the lowest that they hold.
    """
    slices = parts.shape[1]
    counts = np.empty((slices, slices), np.int64)
    least = np.empty(slices, np.int64)
    for one in range(begin, end):
        for i in range(slices):
            for j in range(slices):
                counts[i, j] = _slices_below(parts[one, i, j], lows[one], heights[one], slices)
        most = 0.0
        blocks[one] = 0
        for x_side in range(2):
            for y_side in range(2):
                least[:] = slices
                for wide in range(1, slices + 1):
                    i = wide - 1 if x_side == 0 else slices - wide
                    lowest = slices
                    for deep in range(1, slices + 1):
                        j = deep - 1 if y_side == 0 else slices - deep
                        least[deep - 1] = min(least[deep - 1], counts[i, j])
                        lowest = min(lowest, least[deep - 1])
                        area = _faces_in(wide, deep, lowest, slices, sizes[one], heights[one])
                        if lowest > 0 and area > most * (1.0 + _ROUNDING):
                            most = area
                            blocks[one, 0] = _end(wide, x_side, slices)
                            blocks[one, 1] = _end(deep, y_side, slices)
                            blocks[one, 2] = lowest


@inline_kernel
def _slices_below(height, low, extent, slices):
    """How many of the slices of a box from ``low`` up end below a height."""
    count = np.int64(0)
    while count < slices and low + extent * (count + 1) / slices <= height - _ROUNDING:
        count += 1
    return count


@inline_kernel
def _end(hidden, side, slices):
    """What tells that so many slices are hidden, from the low side or from the high one."""
    if hidden == slices:
        return 0
    return -hidden if side == 0 else slices - hidden


@inline_kernel
def _faces_in(wide, deep, tall, slices, size, height):
    """The area of the walls and the roof of a box that a block at a corner holds."""
    x, y, z = wide / slices * size[0], deep / slices * size[1], tall / slices * height
    walls = x * z * (2.0 if deep == slices else 1.0) + y * z * (2.0 if wide == slices else 1.0)
    return walls + (x * y if tall == slices else 0.0)
