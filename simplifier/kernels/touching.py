"""Draw apart the corners that a polygon's loops visit more than once."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compile import kernel

_PULL = 1e-3  # how far touching corners are drawn apart, in shortest edges


@kernel
def part_touching(points, starts):
    """A copy of the loops in which no corner is visited twice.

    Of the visits to one point, every convex one is pulled into the covered side, by a thousandth
    of the polygon's shortest edge along both of its edges.  At most one visit is reflex.
    """
    count = len(points)
    size = 4
    while size < 2 * count:
        size *= 2
    table = np.full(size, -1, np.int64)  # open addressing; equal points have equal keys
    touching = np.zeros(count, np.bool_)
    found = False
    for index in range(count):
        x, y = points[index, 0], points[index, 1]
        slot = np.int64(x * 7919.0 + y * 104729.0) & (size - 1)
        while table[slot] >= 0:
            other = table[slot]
            if points[other, 0] == x and points[other, 1] == y:
                touching[index] = touching[other] = found = True
            slot = (slot + 1) & (size - 1)
        table[slot] = index
    parted = points.copy()
    if found:
        pull = _PULL * _shortest_edge(points, starts)
        for loop in range(len(starts) - 1):
            _pull_corners(points, starts[loop], starts[loop + 1], touching, pull, parted)
    return parted


@kernel
def _shortest_edge(points, starts):
    shortest = np.inf
    for loop in range(len(starts) - 1):
        previous = starts[loop + 1] - 1
        for index in range(starts[loop], starts[loop + 1]):
            length = np.hypot(
                points[index, 0] - points[previous, 0], points[index, 1] - points[previous, 1]
            )
            if length > 0.0:
                shortest = min(shortest, length)
            previous = index
    return shortest


@kernel
def _pull_corners(points, begin, end, touching, pull, parted):
    for index in range(begin, end):
        if not touching[index]:
            continue
        x, y = points[index]
        before = index - 1 if index > begin else end - 1
        after = index + 1 if index + 1 < end else begin
        back_x, back_y = points[before, 0] - x, points[before, 1] - y
        on_x, on_y = points[after, 0] - x, points[after, 1] - y
        if on_x * back_y - on_y * back_x > 0.0:
            back, on = np.hypot(back_x, back_y), np.hypot(on_x, on_y)
            parted[index, 0] = x + pull * (back_x / back + on_x / on)
            parted[index, 1] = y + pull * (back_y / back + on_y / on)
