"""Which of some objects an edge of a view cell sees: cull maps of rays towards these alone.

As ``cull_map.py``, with objects in place of tiles: what a quick look at all leaves open is few, so
that much shorter pieces of edge are looked from.
"""

from __future__ import annotations

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.cull_map import FIRST_RING, ask, hides, rays_of, reach, see_here, trace


@inner_kernel
def ask_towards(sample, ring, boxes, tops, waiting, asked):
    """Ask for the rays towards the objects ``waiting`` (k,) and no others; the highest of these."""
    px, py, _, ex, ey, _ = sample
    asked[:] = False
    highest = 0.0
    for index in range(len(waiting)):
        ask(boxes[waiting[index]], ring, px, py, ex, ey, asked)
        highest = max(highest, float(tops[waiting[index]]))
    return highest


@inner_kernel
def keep_open(sample, ring, boxes, tops, slopes, waiting):
    """Move those of the objects ``waiting`` (k,) to the front that reach beyond a ring and that it
    does not hide.

    Returns how many they are, and how many were tested.
    """
    px, py, eye, ex, ey, _ = sample
    kept = tests = 0
    for index in range(len(waiting)):
        box = boxes[waiting[index]]
        if reach(box, px, py) > ring:
            tests += 1
            if not hides(box, tops[waiting[index]], ring, px, py, eye, ex, ey, slopes):
                waiting[kept] = waiting[index]
                kept += 1
    return kept, tests


@inner_kernel
def look_for(sample, solid, free, pixels, boxes, tops, scratch, wanted, seen):
    """As :func:`~simplifier.kernels.cull_map.see_from` for some objects alone: sets ``seen`` for
    those ``wanted`` that may be seen, and for others that are met on the way.

    ``boxes``    (n, 4) float64: low and high x, low and high y of each object in pixels.
    ``tops``     (n,) uint16: its highest point.
    ``scratch``  as it takes it, with a place for each object.
    ``wanted``   (n,) bool.
    """
    flat_slopes, flat_asked, waiting = scratch
    steps = tests = count = 0
    see_here(sample[0], sample[1], pixels, seen)
    for index in range(len(wanted)):
        if wanted[index] and not seen[index]:
            waiting[count] = index
            count += 1
    ring = FIRST_RING
    while count > 0:
        slopes, asked = rays_of(flat_slopes, ring), rays_of(flat_asked, ring)
        highest = ask_towards(sample, ring, boxes, tops, waiting[:count], asked)
        for side in range(4):
            for index in range(2 * ring + 1):
                if asked[side, index]:
                    slopes[side, index], took = trace(
                        side, index - ring, ring, sample, highest, solid, free, pixels, seen
                    )
                    steps += took
        unseen = 0
        for index in range(count):
            if not seen[waiting[index]]:
                waiting[unseen] = waiting[index]
                unseen += 1
        count, took = keep_open(sample, ring, boxes, tops, slopes, waiting[:unseen])
        tests += took
        ring *= 2
    return steps, tests


@kernel(
    "int64, int64, float64[:, :], int64[:], uint16[:, :, :, :], int64[:, :], int64[:], ((int64, "
    "int64), int32[:], int32[:], uint16[:], uint16[:, :, :, :], uint16[:, :]), float64[:, :], "
    "uint16[:], (float64[:], bool[:], int32[:]), bool[:, :], bool[:, :], int64[:, :]"
)
def look_from_cells(
    begin, end, samples, sample_starts, solid, free, free_starts, pixels, boxes, tops, scratch,
    wanted, seen, work,
):  # fmt: skip
    """As :func:`~simplifier.kernels.cull_map.see_from_cells`, for the objects that are ``wanted``
    (c, n) bool of each cell.
    """
    for cell in range(begin, end):
        own = free[free_starts[cell] : free_starts[cell + 1]]
        for index in range(sample_starts[cell], sample_starts[cell + 1]):
            steps, tests = look_for(
                samples[index], solid, own, pixels, boxes, tops, scratch, wanted[cell], seen[cell]
            )
            work[cell, 0] += steps
            work[cell, 1] += tests
