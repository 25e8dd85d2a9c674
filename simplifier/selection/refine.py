"""Triangles -> triangles: refine an occluder under the measure, inside its error bound.

The paper ends with the cut.  Its vertices lie on a few planes and were chosen among a few outlines;
as triangles that move freely in space they cover far more.  A corner in turn is moved at random,
and the move is kept when

    sum over views of  R - overcover * (M(occluder) - R),  R = M(occluder and original)

rises, or falls by little while the search is young (simulated annealing).  No triangle may touch a
voxel outside the allowed solid.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from simplifier.deadline import Deadline
from simplifier.geometry.grid import BoolArray
from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.refinement import TRIES
from simplifier.kernels.soup_views import UNIT, all_contained
from simplifier.kernels.threads import run_chunks
from simplifier.options import RefineOptions
from simplifier.selection.annealing import Annealing, RefineViews, Room

_SLICE = 400 * TRIES  # moves between two looks at the listener
_SLICE_SHARE = 0.01  # of a time limit, between two looks at the clock
_SLICE_SECONDS = (0.0005, 0.02)  # at least, so that a slice is worth its start, and at most

_ROUNDS = 10  # how often the searches compare their precision and score
_LAST_ADOPTION = 0.8  # share of the search after which each goes its own way
_DEARER, _CHEAPER = 1.4, 0.85  # what a round changes the price by
_DEAREST = 100 * UNIT
_COARSE = 0.7  # small pictures show errors larger than they are: at outlines they fill whole pixels
_FEW = 64  # triangles that any start is filled up to

Stop = Callable[[float, float], bool]
"""Told the share of the search that is done, and the best score yet as a share of what the original
itself would have; true ends the search with that best."""


def refine(
    starts: Sequence[FloatArray],
    allowed: BoolArray,
    views: RefineViews,
    budget: int,
    options: RefineOptions,
    seed: int,
    stop: Stop = lambda share, measure: False,
    deadline: Deadline | None = None,
) -> FloatArray:
    """The best triangles (m, 3, 3) in grid space, m <= ``budget``, that a search finds.

    ``starts`` are one or more soups (k, 3, 3), each search begins with one of them.  Triangles
    that leave the ``allowed`` (nx, ny, nz) bool voxels are pulled in, what is left of the budget is
    filled up with copies, which soon are put elsewhere.  The result scores no less than the start
    that it came from.  With a ``deadline`` the search lasts until then, whatever ``options.moves``.
    The same arguments give the same result on any number of threads, unless ``stop`` ends the
    search or a deadline does.
    """
    soups = [pulled_in(start, allowed)[:budget] for start in starts]
    soups = [_filled_up(soup, budget) for soup in soups if len(soup) > 0]
    if not soups:
        return np.empty((0, 3, 3))
    room = Room.of(allowed)
    price = _Price(options)
    searches = [
        Annealing(soups[i % len(soups)], room, views, price.now, seed * options.searches + i)
        for i in range(options.searches)
    ]
    slices = _by_moves(options.moves) if deadline is None else _by_time(deadline.rest())
    rounds = 1
    for moves, shares in slices:
        _run(searches, moves, shares)
        if stop(shares[1], max(search.measure for search in searches)):
            break
        if shares[1] * _ROUNDS >= rounds:
            rounds = int(shares[1] * _ROUNDS) + 1
            _confer(searches, price, shares[1])
    return max(searches, key=lambda search: search.score).result()


class _Price:
    """What is hidden wrongly costs more while the precision is below the aim."""

    def __init__(self, options: RefineOptions) -> None:
        self._base = round(UNIT * options.overcover)
        self._aim = 1.0 - (1.0 - options.precision) / _COARSE
        self.now = self._base

    def follow(self, precision: float) -> None:
        if precision < self._aim:
            self.now = min(int(self.now * _DEARER) + 1, _DEAREST)
        elif self.now > self._base:
            self.now = max(int(self.now * _CHEAPER), self._base)


def _confer(searches: list[Annealing], price: _Price, share: float) -> None:
    """All go on from the best, at a price that its precision asks for."""
    best = max(searches, key=lambda search: search.score)
    if share >= 1.0:
        return
    price.follow(best.precision())
    for search in searches:
        if search is not best and share <= _LAST_ADOPTION:
            search.adopt(best)
        search.reprice(price.now)


_Slices = Iterator[tuple[int, tuple[float, float]]]
"""Moves to try, and the shares of the search at their begin and end."""


def _by_moves(moves: int) -> _Slices:
    for first in range(0, moves, _SLICE):
        last = min(first + _SLICE, moves)
        yield last - first, (first / moves, last / moves)


def _by_time(deadline: Deadline) -> _Slices:
    """Slices of about a hundredth of the time each, until it is up."""
    least, most = _SLICE_SECONDS
    aim = min(max(_SLICE_SHARE * deadline.seconds, least), most)
    moves = TRIES  # the first slice is there to learn what a move costs
    while not deadline.is_up:
        left, share = deadline.left, deadline.share
        yield moves, (share, min(share + aim / deadline.seconds, 1.0))
        took = max(left - deadline.left, 1e-6)
        moves = TRIES * max(1, int(moves / TRIES * min(aim / took, 4.0)))


def _run(searches: list[Annealing], moves: int, shares: tuple[float, float]) -> None:
    def work(begin: int, end: int) -> None:
        for search in searches[begin:end]:
            search.run(moves, shares)

    run_chunks(work, len(searches))


def _filled_up(triangles: FloatArray, budget: int) -> FloatArray:
    """The triangles and copies of them in turn, up to the budget or twice as many."""
    count = min(budget, max(2 * len(triangles), _FEW)) if len(triangles) else 0
    return triangles[np.arange(count) % max(len(triangles), 1)]


def pulled_in(triangles: FloatArray, allowed: BoolArray) -> FloatArray:
    """Shrink the triangles that leave the allowed voxels towards their centres until they do not.

    Those that are still outside after that are left out.
    """
    triangles = np.array(triangles, dtype=np.float64)
    inside = np.zeros(len(triangles), dtype=np.bool_)
    for _ in range(_PULLS):
        all_contained(triangles, allowed, inside)
        if inside.all():
            break
        outside = triangles[~inside]
        triangles[~inside] += _PULL * (outside.mean(axis=1, keepdims=True) - outside)
    all_contained(triangles, allowed, inside)
    return triangles[inside]


_PULLS = 48  # steps, each a sixteenth of the way: a twentieth of the size is left at the end
_PULL = 1.0 / 16.0
