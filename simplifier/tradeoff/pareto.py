"""The Pareto front of cost against value, and what keeps every other point off it.

A point dominates another when it costs no more, is worth no less, and is better in one of the two.
The front holds the points that nothing dominates; equal points on it do not dominate each other.
"""

from __future__ import annotations

from collections.abc import Sequence


def dominators(costs: Sequence[float], values: Sequence[float]) -> list[int | None]:
    """For every point the front's point that dominates it, None for those on the front.

    ``costs``, ``values``  of n points each, finite.  Where several front points dominate one, it is
    the one of most value; of equals the cheapest, then the first.
    """
    found: list[int | None] = [None] * len(costs)
    best: int | None = None  # of most value among the points that cost no more
    for point in sorted(range(len(costs)), key=lambda i: (costs[i], -values[i], i)):
        if best is None or values[point] > values[best]:
            best = point
        elif (costs[point], values[point]) != (costs[best], values[best]):
            found[point] = best
    return found
