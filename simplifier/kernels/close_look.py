"""Which of some objects an edge of a view cell sees: cull maps of rays towards these alone.

As ``cull_map.py``, with objects in place of tiles: what a quick look at all leaves open is few, so
that much shorter pieces of edge are looked from.
"""

from __future__ import annotations

from simplifier.kernels.compile import kernel
from simplifier.kernels.cull_map import FIRST_RING, ask, hides, reach, see_here, trace


@kernel
def look_for(sample, solid, free, pixels, boxes, tops, scratch, wanted, seen):
    """As :func:`~simplifier.kernels.cull_map.see_from` for some objects alone: sets ``seen`` for
    those ``wanted`` that may be seen, and for others that are met on the way.

    ``boxes``    (n, 4) float64: low and high x, low and high y of each object in pixels.
    ``tops``     (n,) uint16: its highest point.
    ``scratch``  as it takes it, with a place for each object.
    ``wanted``   (n,) bool.
    """
    px, py, eye, ex, ey, _ = sample
    flat_slopes, flat_asked, waiting = scratch
    steps = tests = count = 0
    see_here(px, py, pixels, seen)
    for index in range(len(wanted)):
        if wanted[index] and not seen[index]:
            waiting[count] = index
            count += 1
    ring = FIRST_RING
    while count > 0:
        slopes = flat_slopes[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        asked = flat_asked[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        asked[:] = False
        highest = 0.0
        for index in range(count):
            ask(boxes[waiting[index]], ring, px, py, ex, ey, asked)
            highest = max(highest, float(tops[waiting[index]]))
        for side in range(4):
            for index in range(2 * ring + 1):
                if asked[side, index]:
                    slopes[side, index], took = trace(
                        side, index - ring, ring, sample, highest, solid, free, pixels, seen
                    )
                    steps += took
        kept = 0
        for index in range(count):
            box = boxes[waiting[index]]
            if seen[waiting[index]] or reach(box, px, py) <= ring:
                continue
            tests += 1
            if not hides(box, tops[waiting[index]], ring, px, py, eye, ex, ey, slopes):
                waiting[kept] = waiting[index]
                kept += 1
        count = kept
        ring *= 2
    return steps, tests


@kernel
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
