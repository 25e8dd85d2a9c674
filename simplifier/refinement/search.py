"""Triangles -> triangles: refine an occluder under the measure, inside its error bound.

The paper ends with the cut.  Its vertices lie on a few planes and were chosen among a few outlines;
as triangles that move freely in space they cover far more.  A corner in turn is moved at random,
and the move is kept when

    sum over views of  R - overcover * (M(occluder) - R) - fine * A(occluder without original)
                       - toll * A(occluder in front of original),
    R = M(occluder and original), A the area

rises, or falls by little while the search is young (simulated annealing).  No triangle may leave
the room.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.room import SURFACE, Room
from simplifier.kernels.annealing import TRIES
from simplifier.kernels.soup_views import FRONT_STEP, UNIT
from simplifier.kernels.threads import run_each
from simplifier.options.stages import RefineOptions
from simplifier.progress import Deadline
from simplifier.refinement.annealing import (
    ALONE,
    TOGETHER,
    Annealing,
    Prices,
    RefineViews,
    pull_each,
    score,
    score_of_original,
)
from simplifier.refinement.finalists import DEAREST, Outlines

_SLICE = 400 * TRIES  # moves between two looks at the listener, at most
_SLICE_SHARE = 0.01  # of a time limit, between two looks at the clock
_SLICE_SECONDS = (0.0005, 0.02)  # at least, so that a slice is worth its start, and at most

_ROUNDS = 20  # how often the searches compare their precision and score, at most
_ROUND_SECONDS = 0.02  # that a time limit has to leave for each of them
_LAST_EXCHANGE = 0.85  # share of the search until which all take from each other, round by round
_FEW = 64  # triangles that any start is filled up to
_LONG = 2_200  # moves a triangle, of which a search that has more begins hotter
_HOTTER = 0.8  # by this power of how many times as many it has
_HOTTEST = 6.0  # times as hot, at most: four triangles hide no more by hotter searches

Stop = Callable[[float, float, Callable[[], FloatArray]], bool]
"""Told the share of the search that is done, the best score yet as a share of what the original
itself would have, and what gives the triangles (m, 3, 3) of that score, in grid space, while the
call lasts; true ends the search with that best."""


def refine(
    starts: Sequence[FloatArray],
    room: Room,
    views: RefineViews,
    budget: int,
    options: RefineOptions,
    seed: int,
    stop: Stop = lambda share, measure, best: False,
    deadline: Deadline | None = None,
    outlines: Outlines | None = None,
    widest: int | None = None,
) -> list[FloatArray]:
    """The best triangles (m, 3, 3) in grid space, m <= ``budget``, of each search.

    ``starts`` are soups (k, 3, 3), one at least.  One search begins with the first, others with
    those of the rest that score most.  Triangles that leave the ``room`` are pulled in, what is
    left of the budget is filled up with copies, which soon are put elsewhere.  A result scores no
    less than the start that its search began with.  With a ``deadline`` the search lasts until
    then, whatever ``options.moves``.  Overhang is judged by ``outlines``, which the search does not
    see, or by its own views; where it is next to nothing, the room grows, to ``widest`` layers at
    most, by default to what it had.  The same arguments give the same result on any number of
    threads, unless ``stop`` ends the search or a deadline does.
    """
    soups = _pad_to_equal([pull_into(start, room)[:budget] for start in starts], budget)
    if not soups:
        return []
    most, pace = _ROUNDS, 1.0
    if deadline is None:
        pace = _step(options, options.rounds) / _step(options, _USUAL_ROUNDS)
    else:
        most = min(max(int(deadline.left / _ROUND_SECONDS), 1), _ROUNDS)
    bargain = Bargain(options, views, outlines, room, pace, widest)
    heat = _first_heat(options, len(soups[0]), deadline)
    searches = _begin_searches(soups, options.searches, room, views, bargain.prices, seed, heat)
    slices = _by_moves(options) if deadline is None else _by_time(deadline.rest())
    rounds = 1
    for moves, shares in slices:
        _run(searches, bargain, moves, shares)
        leader = max(searches, key=lambda search: search.measure)
        if stop(shares[1], leader.measure, leader.best):
            break
        if shares[1] * most >= rounds:
            rounds = int(shares[1] * most) + 1
            _confer(searches, bargain, shares[1])
    for search in searches:  # at the prices of a round that nothing followed, if time was up
        bargain.hold(search)
    searches.sort(key=lambda search: -search.score)
    return run_each(Annealing.result, searches)


def hidden_share(
    triangles: FloatArray, room: Room, views: RefineViews, options: RefineOptions
) -> float:
    """The score of triangles (m, 3, 3) as a search begins, as a share of the original's own."""
    drawn = pull_into(triangles, room)
    if len(drawn) == 0:
        return 0.0
    prices = Bargain(options, views, None, room).prices
    return max(score(drawn, views, prices) / score_of_original(views, prices), 0.0)


def _begin_searches(
    soups: Sequence[FloatArray],
    count: int,
    room: Room,
    views: RefineViews,
    prices: Prices,
    seed: int,
    heat: float,
) -> list[Annealing]:
    """As many searches: of the first soup, then of the others by score, and again.  One that is
    alone begins with what scores most."""

    def search(begin: tuple[FloatArray, int]) -> Annealing:
        soup, index = begin
        return Annealing(soup, room, views, prices, seed * count + index, heat)

    first = soups[:1] if count > 1 or len(soups) == 1 else []
    others = soups[len(first) :]
    scores = run_each(lambda soup: score(soup, views, prices), others)
    best_first = sorted(range(len(others)), key=lambda one: -scores[one])
    ranked = [*first, *(others[one] for one in best_first)]
    return run_each(search, [(ranked[index % len(ranked)], index) for index in range(count)])


def _first_heat(options: RefineOptions, triangles: int, deadline: Deadline | None) -> float:
    """Searches that exchange begin hotter where they have many moves a triangle: there is time for
    each to find its place again."""
    if options.searches == 1:
        return ALONE
    if deadline is not None:  # how many moves that leaves is not known yet
        return TOGETHER
    long = options.moves / (_LONG * triangles)
    return float(TOGETHER * min(max(long, 1.0) ** _HOTTER, _HOTTEST))


def _confer(searches: list[Annealing], bargain: Bargain, share: float) -> None:
    """All take from each other, and are to go on at prices that the best one's precision and
    overhang ask for."""
    if share >= 1.0:
        return
    if share < _LAST_EXCHANGE and len(searches) > 1:
        _exchange(searches)
    bargain.follow(max(searches, key=lambda search: search.score), share)


def _exchange(searches: list[Annealing]) -> None:
    """Each takes from the next one, as that was before, what it gains by; the last from the first.

    So what one has found is not lost where another has found more, and they stay different.
    """
    found = [search.current() for search in searches]
    run_each(
        lambda index: searches[index].take_from(found[(index + 1) % len(found)]), range(len(found))
    )


_Slices = Iterator[tuple[int, tuple[float, float]]]
"""Moves to try, and the shares of the search at their begin and end."""


def _step(options: RefineOptions, rounds: int) -> int:
    """Moves of a slice, in a search of so many rounds at least."""
    if options.overhang >= 1.0:
        return _SLICE
    # Prices follow overhang, so that even a short search needs some rounds.
    return min(_SLICE, TRIES * max(1, options.moves // (TRIES * rounds)))


def _by_moves(options: RefineOptions) -> _Slices:
    moves, step = options.moves, _step(options, options.rounds)
    for first in range(0, moves, step):
        last = min(first + step, moves)
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


def _run(
    searches: list[Annealing], bargain: Bargain, moves: int, shares: tuple[float, float]
) -> None:
    def go_on(search: Annealing) -> None:
        bargain.hold(search)
        search.run(moves, shares)

    run_each(go_on, searches)


def _pad_to_equal(soups: Sequence[FloatArray], budget: int) -> list[FloatArray]:
    """Those that are not empty, and copies of their triangles in turn, up to one number for all.

    That is the budget, or less where it is more than twice what any start has.
    """
    count = min(budget, max(_FEW, *(2 * len(soup) for soup in soups)))
    return [soup[np.arange(count) % len(soup)] for soup in soups if len(soup) > 0]


def pull_into(triangles: FloatArray, room: Room) -> FloatArray:
    """The triangles in the room as :func:`~.annealing.pull_each` draws them; the rest left out."""
    drawn, inside = pull_each(triangles, room)
    return drawn[inside]


_USUAL_ROUNDS = 10  # for which the changes below are right; in fewer each changes by more
_DEARER, _CHEAPER = 1.5, 0.8  # what a round changes the price by, at most
_DEAREST = round(UNIT * DEAREST)  # a search that pays more loses more than it is judged by
_OVERLOOKED = 1.5  # what is hidden wrongly in all views, beside those that the search looks from

_FINE = 800.0  # of a pixel past the outline at first: 25 units of twice a measure
_HIGHER, _LOWER = 2.0, 0.6  # what a round changes all fines by, at most and at first
_MOST, _LEAST = 64.0, 1.0 / _FINE  # times the first
_HASTY = 0.015  # of overhang asked for, below which fines that have few rounds begin higher
_HASTE = 3.0  # the power of the pace that is as many times the first as they begin at, at most

_TOLL = 100.0  # of a pixel in front at first
_MOST_TOLL = 16.0  # times that: beyond, meshes that cannot have so little lose all they hide

_CLOSE = 0.85  # of the overhang asked for: what the search aims at, since views differ
_UNSEEN = 2.5  # times the overhang in the search's own pictures: that in fine ones
_SHOWN = 0.35  # of the aim: where its own pictures show less than that, fines do not reach the rest
_FAR, _SETTLED = 1.1, 0.7  # times the aim that call for less room, until that share of the search
_PAUSE = 3  # rounds at least since the room became another: before, overhang tells of the old one
_NEAR = 0.6  # times the aim below which there may be more room again
_NEXT_TO_NOTHING = 0.15  # the same for more room than the search began in


class Bargain:
    """Prices that rise while too much is hidden wrongly or sticks out, and a room that follows.

    A search learns its own views by heart, and what sticks out by less than its pixels can show
    costs it nothing.  So overhang is judged in finer pictures from elsewhere, and prices follow.

    Fines are in proportion to what share of a view's silhouette a pixel is, so that they price the
    mean of these shares.  Changes get smaller as the search cools: a late one could only take out
    triangles, not move them, and where pixels are too coarse for the precision that is asked for
    the price would rise without end.  What sticks out by less than the search's pixels can show is
    kept in by a narrower room, which loses a layer at a time, and gains one where it may.

    What stands in front of the surface has its toll, which follows in the same way but for one
    thing: a sheet, or a mesh that is open below, cannot have next to none, so the toll ends where
    it would only take out triangles.

    ``outlines``  where overhang and front are judged; None: by the search's own views.
    ``widest``    layers that the room may grow to; None: no more than it has.
    ``pace``      times as many moves between two rounds as usual: prices change to that power, and
                  fines begin higher where little may stick out, since there are few rounds to rise.
    """

    def __init__(
        self,
        options: RefineOptions,
        views: RefineViews,
        outlines: Outlines | None,
        room: Room,
        pace: float = 1.0,
        widest: int | None = None,
    ) -> None:
        self.room = room
        self._least = self._price = round(UNIT * options.overcover)
        self._wrong = (1.0 - options.precision) / _OVERLOOKED
        self._overhang, self._outlines = options.overhang, outlines
        areas = np.maximum(np.bitwise_count(views.originals).sum(axis=1, dtype=np.int64), 1)
        self._fines = _FINE * areas.mean() / areas
        scarce = max(_HASTY / max(self._overhang, 1e-6), 1.0)
        self._level = min(scarce, max(pace, 1.0) ** _HASTE)
        self._pace = pace
        self._widest = room.limit if widest is None else widest
        self._begun = room.limit
        self._since = 0  # rounds in the same room
        self._front = options.front if views.depths.known else 1.0
        self._tolls = FRONT_STEP * _TOLL * areas.mean() / areas
        self._toll = 1.0

    @property
    def prices(self) -> Prices:
        """As they are now."""
        fines: NDArray[np.int64] | int = 0
        tolls: NDArray[np.int64] | int = 0
        if self._overhang < 1.0:
            fines = np.ceil(self._level * self._fines).astype(np.int64)
        if self._front < 1.0:
            tolls = np.ceil(self._toll * self._tolls).astype(np.int64)
        return Prices(self._price, fines, tolls)

    def hold(self, search: Annealing) -> None:
        """Have a search go on in the room and at the prices of now."""
        if search.room is not self.room:
            search.move_to(self.room)
        search.reprice(self.prices)

    def follow(self, search: Annealing, share: float) -> None:
        """Change by what a search hides wrongly and beside, ``share`` of the way through."""
        wrong = (1.0 - search.precision()) / max(self._wrong, 1e-9)
        if wrong > 1.0:
            change = min(wrong**0.5, _DEARER) ** (self._pace * (1.0 - share) ** 0.5)
            self._price = min(int(self._price * change) + 1, max(_DEAREST, self._least))
        elif self._price > self._least:
            self._price = max(int(self._price * max(wrong, _CHEAPER) ** self._pace), self._least)
        if self._overhang < 1.0:
            self._follow_overhang(search, share)
        if self._front < 1.0:
            self._follow_front(search, share)

    def _follow_front(self, search: Annealing, share: float) -> None:
        aim = max(_CLOSE * self._front, 1e-6)
        if self._outlines is None or not self._outlines.depths.known:
            found = float(search.front().mean())
        else:
            found = float(self._outlines.front(search.current()).mean())
        change = self._change(found / aim, share)
        self._toll = min(max(self._toll * change, 1.0 / _TOLL), _MOST_TOLL)

    def _follow_overhang(self, search: Annealing, share: float) -> None:
        aim = max(_CLOSE * self._overhang, 1e-6)
        shown = float(search.overhang().mean())
        if self._outlines is None:
            found = _UNSEEN * shown
        else:
            found = float(self._outlines.overhang(search.current()).mean())
        self._since += 1
        if shown <= _SHOWN * aim and self._other_room(found / aim, share):
            self._since = 0
        elif found <= aim or shown > _SHOWN * aim:
            self._level = min(max(self._level * self._change(found / aim, share), _LEAST), _MOST)

    def _change(self, times: float, share: float) -> float:
        """What fines or tolls are multiplied by where so many times the aim was found."""
        return float(min(max(times, _LOWER), _HIGHER) ** (self._pace * (1.0 - share)))

    @property
    def _growing(self) -> float:
        """Times the aim, below which there may be more room."""
        return _NEAR if self.room.limit < self._begun else _NEXT_TO_NOTHING

    def _other_room(self, overhang: float, share: float) -> bool:
        """Take a layer off the room, or give it one, by overhang as a share of what is aimed at.

        Returns whether it did.
        """
        limit = self.room.limit
        if overhang > _FAR and share < _SETTLED and self._since >= _PAUSE and limit > SURFACE:
            self.room = self.room.up_to(limit - 1)
        elif overhang < self._growing and share < _LAST_EXCHANGE and limit < self._widest:
            self.room = self.room.up_to(limit + 1)
        return self.room.limit != limit
