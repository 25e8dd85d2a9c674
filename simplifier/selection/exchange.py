"""Candidates -> Cut within a budget: choose (polygon, level) pairs by gain, improve by exchange.

Stands in for the paper's two steps (complete cut, then trim by area), whose trim is blind to what
the measure says; ``docs/decisions`` has the figures of both and of what else was tried.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import IntArray
from simplifier.kernels.exchange import search_cut
from simplifier.kernels.threads import run_chunks
from simplifier.progress import TellShare, silent
from simplifier.selection.candidates import Candidates
from simplifier.selection.greedy import Cut

_POWERS = (1.0, 0.85)  # one search each; a lower power likes larger polygons
_NEXT_TO_NOTHING = 0.125  # of the budget
_LEVELS = np.array(sorted(set(np.round(np.geomspace(1.0, 1e5, 40)))), dtype=np.int32)
"""They grow by a third: those between change little that a search can see."""


def choose_by_gain(
    candidates: Candidates,
    budget: int,
    alpha: float,
    exchanges: int = 8,
    seed: int = 0,
    tell: TellShare = silent,
) -> Cut:
    """The best cut that greedy choice and exchange reach within ``budget`` triangles.

    Pairs are added by gain a triangle until the budget is spent or the next would raise the measure
    by less than ``alpha`` of it.  Then, ``exchanges`` times, two members are taken out and the
    freed triangles spent anew, which is kept when the measure rises.  Two such searches weigh the
    cost of a pair differently; the better result is returned, the first of equals.  Without
    exchanges one is enough, since refining makes up for the little that the other one adds, unless
    it ends with next to nothing.

    ``tell`` is called every few milliseconds; what it raises ends the search soon.
    """
    if len(candidates) == 0:
        return np.zeros(0, dtype=np.int32)
    polygons, levels, firsts = _pairs(candidates.triangles, budget)
    found: list[tuple[Cut, int]] = [(np.zeros(0, np.int32), -1)] * len(_POWERS)

    halt = np.zeros(1, dtype=np.uint8)

    def tell_or_halt(share: float) -> None:
        try:
            tell(share)
        except BaseException:
            halt[0] = 1
            raise

    watched = tell is not silent
    bounds = candidates.full_gains((lambda share: tell(0.0)) if watched else silent)

    def search(begin: int, end: int) -> None:
        for index in range(begin, end):
            weights = np.maximum(np.arange(budget + 1.0), 1.0) ** -_POWERS[index]
            found[index] = search_cut(
                candidates.points, candidates.lowest, candidates.offsets, candidates.maps,
                candidates.triangles, polygons, levels, firsts, (budget, alpha, weights),
                exchanges, seed + index, halt, candidates.standing, bounds,
            )  # fmt: skip

    heard = tell_or_halt if watched else silent
    run_chunks(search, len(_POWERS) if exchanges > 0 else 1, tell=heard)
    if exchanges == 0 and found[0][0].sum() <= _NEXT_TO_NOTHING * budget:
        run_chunks(lambda begin, end: search(begin + 1, end + 1), len(_POWERS) - 1, tell=heard)
    return max(found, key=lambda result: result[1])[0]


def _pairs(triangles: IntArray, budget: int) -> tuple[IntArray, IntArray, NDArray[np.int64]]:
    """Polygon and level of each pair, and where each polygon's pairs begin.

    Levels grow by about a third; the last is the full one, if the budget allows it.
    """
    full = np.minimum(triangles, budget).astype(np.int32)
    counts = np.searchsorted(_LEVELS, full) + 1
    firsts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    polygons = np.repeat(np.arange(len(triangles), dtype=np.int32), counts)
    levels = np.append(_LEVELS, full[-1])[np.arange(firsts[-1]) - firsts[polygons]]
    levels[firsts[1:] - 1] = full
    return polygons, levels, firsts
