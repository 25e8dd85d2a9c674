"""Which of some objects an edge of a view cell sees: cull maps of rays towards these alone.

As ``cull_map.py``, with objects in place of tiles: what a quick look at all leaves open is few, so
that much shorter pieces of edge are looked from.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel
from simplifier.kernels.cull_map import FIRST_RING, ask, hides, reach, trace


@kernel
def look_for(
    sample, pairs, turned, free, field, blocks, blocks_y, boxes, tops, scratch, wanted, seen
):
    """As :func:`~simplifier.kernels.cull_map.see_from` for some objects alone: sets ``seen`` for
    those ``wanted`` that may be seen, and for others that are met on the way.

    ``blocks``   (b,) float32: the highest objects in blocks of pixels, ``blocks_y`` along y.
    ``boxes``    (n, 4) float64: low and high x, low and high y of each object in pixels.
    ``tops``     (n,) float32: its highest point.
    ``scratch``  as it takes it, with a place for each object.
    ``wanted``   (n,) bool.
    """
    px, py, eye, ex, ey, _ = sample
    flat_slopes, flat_asked, waiting = scratch
    nx, ny = pairs.shape[:2]
    steps = tests = count = 0
    ix, iy = np.int64(np.floor(px)), np.int64(np.floor(py))
    if 0 <= ix < nx and 0 <= iy < ny:  # where no ray has made a step yet
        for item in range(field[0][ix * ny + iy], field[0][ix * ny + iy + 1]):
            seen[field[1][item]] = True
    for index in range(len(wanted)):
        if wanted[index] and not seen[index]:
            waiting[count] = index
            count += 1
    ring = FIRST_RING
    while count > 0:
        slopes = flat_slopes[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        asked = flat_asked[: 4 * (2 * ring + 1)].reshape(4, 2 * ring + 1)
        asked[:] = False
        highest = -np.inf
        for index in range(count):
            ask(boxes[waiting[index]], ring, px, py, ex, ey, asked)
            highest = max(highest, tops[waiting[index]])
        for side in range(4):
            for index in range(2 * ring + 1):
                if asked[side, index]:
                    slope, took = trace(
                        side, index - ring, ring, px, py, eye, highest - eye, pairs, turned, free,
                        field, blocks, blocks_y, seen,
                    )  # fmt: skip
                    slopes[side, index] = slope
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
    begin, end, samples, sample_starts, pairs, turned, free, free_starts, field, blocks, blocks_y,
    boxes, tops, scratch, wanted, seen, work,
):  # fmt: skip
    """As :func:`~simplifier.kernels.cull_map.see_from_cells`, for the objects that are ``wanted``
    (c, n) bool of each cell.
    """
    for cell in range(begin, end):
        own = free[free_starts[cell] : free_starts[cell + 1]]
        for index in range(sample_starts[cell], sample_starts[cell + 1]):
            steps, tests = look_for(
                samples[index], pairs, turned, own, field, blocks, blocks_y, boxes, tops, scratch,
                wanted[cell], seen[cell],
            )  # fmt: skip
            work[cell, 0] += steps
            work[cell, 1] += tests
