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

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.annealing import TRIES
from simplifier.kernels.soup_views import UNIT, all_contained
from simplifier.kernels.threads import run_chunks
from simplifier.options.stages import RefineOptions
from simplifier.progress import Deadline
from simplifier.refinement.annealing import Annealing, RefineViews, Room

_SLICE = 400 * TRIES  # moves between two looks at the listener
_SLICE_SHARE = 0.01  # of a time limit, between two looks at the clock
_SLICE_SECONDS = (0.0005, 0.02)  # at least, so that a slice is worth its start, and at most

_ROUNDS = 20  # how often the searches compare their precision and score
_ROUND_SECONDS = 0.02  # that a time limit has to leave for each of them
_LAST_ADOPTION = 0.85  # share of the search until which all go on from the best, round by round
_DEARER, _CHEAPER = 1.5, 0.8  # what a round changes the price by, at most
_DEAREST = 200 * UNIT
_OVERLOOKED = 1.5  # what is hidden wrongly in all views, beside those that the search looks from
_FEW = 64  # triangles that any start is filled up to

Stop = Callable[[float, float, Callable[[], FloatArray]], bool]
"""Told the share of the search that is done, the best score yet as a share of what the original
itself would have, and what gives the triangles (m, 3, 3) of that score, in grid space, while the
call lasts; true ends the search with that best."""


def refine(
    starts: Sequence[FloatArray],
    allowed: BoolArray,
    views: RefineViews,
    budget: int,
    options: RefineOptions,
    seed: int,
    stop: Stop = lambda share, measure, best: False,
    deadline: Deadline | None = None,
) -> list[FloatArray]:
    """The best triangles (m, 3, 3) in grid space, m <= ``budget``, of each search.

    ``starts`` are soups (k, 3, 3), one at least.  One search begins with the first, others with
    those of the rest that score most.  Triangles that leave the ``allowed`` (nx, ny, nz) bool
    voxels are pulled in, what is left of the budget is filled up with copies, which soon are put
    elsewhere.  A result scores no less than the start that its search began with.  With a
    ``deadline`` the search lasts until then, whatever ``options.moves``.  The same arguments give
    the same result on any number of threads, unless ``stop`` ends the search or a deadline does.
    """
    soups = _pad_to_equal([pull_into(start, allowed)[:budget] for start in starts], budget)
    if not soups:
        return []
    room, price = Room.of(allowed), _Price(options)
    searches = _begin_searches(soups, options.searches, room, views, price.now, seed)
    slices = _by_moves(options.moves) if deadline is None else _by_time(deadline.rest())
    most, rounds = _ROUNDS, 1
    if deadline is not None:
        most = min(max(int(deadline.left / _ROUND_SECONDS), 1), _ROUNDS)
    for moves, shares in slices:
        _run(searches, moves, shares)
        leader = max(searches, key=lambda search: search.measure)
        if stop(shares[1], leader.measure, leader.best):
            break
        if shares[1] * most >= rounds:
            rounds = int(shares[1] * most) + 1
            _confer(searches, price, shares[1])
    searches.sort(key=lambda search: -search.score)
    return [search.result() for search in searches]


def _begin_searches(
    soups: Sequence[FloatArray], count: int, room: Room, views: RefineViews, price: int, seed: int
) -> list[Annealing]:
    """As many searches: of the first soup, then of the others by score, and again."""

    def search(soup: FloatArray, index: int) -> Annealing:
        return Annealing(soup, room, views, price, seed * count + index)

    others = sorted(soups[1:], key=lambda soup: -search(soup, 0).score) if count > 1 else []
    ranked = [soups[0], *others]
    return [search(ranked[index % len(ranked)], index) for index in range(count)]


class _Price:
    """What is hidden wrongly costs more while the precision is below the aim."""

    def __init__(self, options: RefineOptions) -> None:
        self._base = round(UNIT * options.overcover)
        self._allowed = (1.0 - options.precision) / _OVERLOOKED
        self.now = self._base

    def follow(self, precision: float) -> None:
        """Change by what is hidden wrongly, too much or too little; more at once overshoots."""
        wrong = (1.0 - precision) / max(self._allowed, 1e-9)
        if wrong > 1.0:
            self.now = min(int(self.now * min(wrong**0.5, _DEARER)) + 1, _DEAREST)
        elif self.now > self._base:
            self.now = max(int(self.now * max(wrong, _CHEAPER)), self._base)


def _confer(searches: list[Annealing], price: _Price, share: float) -> None:
    """All go on from the best, at a price that its precision asks for."""
    best = max(searches, key=lambda search: search.score)
    if share >= 1.0:
        return
    price.follow(best.precision())
    for search in searches:
        if search is not best and share < _LAST_ADOPTION:
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


def _pad_to_equal(soups: Sequence[FloatArray], budget: int) -> list[FloatArray]:
    """Those that are not empty, and copies of their triangles in turn, up to one number for all.

    That is the budget, or less where it is more than twice what any start has.
    """
    count = min(budget, max(_FEW, *(2 * len(soup) for soup in soups)))
    return [soup[np.arange(count) % len(soup)] for soup in soups if len(soup) > 0]


def pull_into(triangles: FloatArray, allowed: BoolArray) -> FloatArray:
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
