"""Cut -> Cut: shed triangles until the budget holds, as published (section 4.5 of the paper)."""

from __future__ import annotations

import heapq

from simplifier.selection.candidates import Candidates
from simplifier.selection.greedy import Cut


def trim_by_area(candidates: Candidates, cut: Cut, budget: int) -> Cut:
    """Take one triangle at a time from the chain that loses the least surface area by it.

    That keeps the surface area of the cut as large as each step can.  Of equal losses the polygon
    that comes first gives way.  A cut within the budget is returned as it is.
    """
    trimmed = cut.copy()
    areas = {int(p): candidates.areas(int(p)) for p in trimmed.nonzero()[0]}
    queue = [(areas[p][trimmed[p]] - areas[p][trimmed[p] - 1], p) for p in areas]
    heapq.heapify(queue)
    for _ in range(int(trimmed.sum()) - budget):
        _, polygon = heapq.heappop(queue)
        trimmed[polygon] -= 1
        level = trimmed[polygon]
        if level > 0:
            loss = areas[polygon][level] - areas[polygon][level - 1]
            heapq.heappush(queue, (loss, polygon))
    return trimmed
