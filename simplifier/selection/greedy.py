"""Candidates -> Cut: add whole polygons until the cut is alpha-complete (section 4.5).

Cut -> Cut: shed triangles until the budget holds, as published (section 4.5 of the paper).
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import IntArray
from simplifier.selection.candidates import Candidates, Images, score

Cut = IntArray
"""(p,) int32: triangles taken of each polygon, 0 for none (the paper's C)."""

_BATCH = 16  # stale candidates scored together, so that all processors have work


def greedy_cut(candidates: Candidates, alpha: float, *, lazy: bool = True) -> Cut:
    """Add the polygon that raises the occlusion measure most, until none adds ``alpha`` of it.

    Lazy evaluation keeps each polygon's last known gain as an upper bound and looks at the best
    first.  The measure is not submodular, so a bound may fail: then another polygon is taken than
    without it, which the tests show to be rare and to cost next to nothing.  Before the end all
    polygons are looked at, so the cut is complete in either form.  Of equal gains the polygon that
    comes first wins.
    """
    cut = np.zeros(len(candidates), dtype=np.int32)
    union = candidates.standing.copy()
    total = score(union)
    gains = np.full(len(candidates), np.iinfo(np.int64).max)
    while (cut == 0).any():
        least = max(1.0, alpha * total)
        best = _best(candidates, union, total, gains, lazy=lazy)
        if lazy and gains[best] < least:
            best = _best(candidates, union, total, gains, lazy=False)
        if gains[best] < least:
            break
        cut[best] = candidates.triangles[best]
        union |= candidates.draw(best, int(cut[best]))
        total = score(union)
        gains[best] = -1
    return cut


def _best(
    candidates: Candidates, union: Images, total: int, gains: NDArray[np.int64], *, lazy: bool
) -> int:
    """The polygon with the largest gain; ``gains`` is brought up to date as far as needed."""
    fresh = gains < 0  # polygons of the cut
    while True:
        stale = np.nonzero(~fresh)[0]
        best = int(gains.argmax())
        if fresh[best] or len(stale) == 0:
            return best
        if lazy:
            stale = stale[np.argsort(-gains[stale], kind="stable")[:_BATCH]]
        if gains[stale[0]] == np.iinfo(np.int64).max:
            stale = np.nonzero(~fresh)[0]
        polygons = stale.astype(np.int32)
        gains[stale] = candidates.scores(polygons, candidates.triangles[polygons], union) - total
        fresh[stale] = True


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
