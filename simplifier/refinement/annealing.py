"""One search: a triangle soup, its pictures, and the moves that improve it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.overrides import NOTHING
from simplifier.geometry.room import EVERYWHERE, Room
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.annealing import anneal, take_from
from simplifier.kernels.overhang import count_beside, widen
from simplifier.kernels.pull import pull_triangles
from simplifier.kernels.random_quads import full_areas
from simplifier.kernels.soup_views import (
    FRONT_ROWS,
    FRONT_STEP,
    Images,
    draw_soup,
    draw_union,
    empty_pictures,
    remove_useless,
    score_unions,
)
from simplifier.refinement.depths import NO_DEPTHS, Depths, lines_of_sight
from simplifier.refinement.finalists import precision_and_recall

_STEPS = (6.0 / 64.0, 0.3 / 64.0)  # of the grid that a move spans at first and at last
ALONE, TOGETHER = 5e-4, 7e-4
"""Losses that a search takes at first, as shares of the original's measure: more where another one
keeps what it gives up."""

_LAST_HEAT = 2e-5  # what it takes at last
_GLANCE = 16  # views that a move is judged on first; then on four times as many, and so on
_PULLS = 48  # steps, each a sixteenth of the way: a twentieth of the size is left at the end
_PULL = 1.0 / 16.0
_SHIFTS = np.array([0.0, 0.5, -0.5, 1.0, -1.0, 1.5, -1.5, 2.0, -2.0])  # voxels, tried in turn
_SHEET = 1.0  # cells: a slab as thin as that shows nothing but outline on edge
_FROM_ABOVE = 0.5  # the sine of the angle at which a view looks at the sides of a slab, at least
_FEW = 50  # triangles up to which a move is as hot; each of more has less to lose


@dataclass(frozen=True, eq=False)
class RefineViews:
    """What the search looks at.

    ``projections``  (V, 2, 4), those of the first looks at a move first (:func:`by_looks`).
    ``originals``    (V, 64) the original's bits, those of the drawn triangles among them.
    ``drawn``        (k, 3, 3) triangles that hide too, whatever the search does; may be none.
    ``depths``       before which a triangle is in front; none where that costs nothing.
    """

    projections: FloatArray
    originals: Images
    drawn: FloatArray = field(default_factory=lambda: NOTHING)
    depths: Depths = field(default_factory=lambda: NO_DEPTHS)

    @cached_property
    def full(self) -> FloatArray:
        """(V,) :func:`~.random_quads.full_areas` of the originals, which every round asks for."""
        return full_areas(self.originals[:, :, None], 64)

    @property
    def rows(self) -> int:
        """Of a picture of a soup: 64 of its silhouette, and those of what is in front if asked."""
        return 64 + FRONT_ROWS if self.depths.known else 64

    def outline(self, slab: FloatArray = EVERYWHERE) -> float:
        """Overhang if something stuck out by a unit of space all around: the mean over all views of
        the outline's length as a share of the silhouette's area.  0 where nothing shows.

        On edge a sheet is all outline, though what keeps to its ``slab`` cannot stick out across
        it: then of views from above its sides alone.
        """
        masks = np.ascontiguousarray(self.originals[:, :, None])
        wide = np.empty_like(masks)
        there, around = np.empty((2, len(masks)), dtype=np.int64)
        widen(masks, 0, len(masks), wide, there)
        count_beside(masks, wide, 0, len(masks), around)
        scale = np.linalg.norm(self.projections[:, 0, :3], axis=1)
        shares = around * scale / np.maximum(there, 1)
        told = there > 0
        if slab[4] - slab[3] < _SHEET:
            told &= np.abs(lines_of_sight(self.projections) @ slab[:3]) > _FROM_ABOVE
        return float(shares[told].mean()) if told.any() else 0.0

    def standing(self) -> Images:
        """(V, rows) the picture of the drawn triangles, which stand in front of nothing."""
        there = np.zeros((len(self.projections), 64), dtype=np.uint64)
        draw_union(np.array(self.drawn), self.projections, NO_DEPTHS.arrays(), there)
        return np.pad(there, ((0, 0), (0, self.rows - 64)))


@lru_cache
def _looks(count: int) -> NDArray[np.int64]:
    """(n, 2) of the looks at a move in so many views: at which one each ends, and how many times as
    many there are."""
    strides = [1]
    while 2 * strides[-1] * _GLANCE <= count:
        strides.append(2 * strides[-1])
    strides = [*strides[:0:-2], 1]
    return np.array([(-(-count // stride), stride) for stride in strides], dtype=np.int64)


def by_looks(projections: FloatArray) -> FloatArray:
    """(V, 2, 4) projections that are spread evenly, in another order: those of each look at a move
    follow each other, and are spread evenly too."""
    numbers, after = np.arange(len(projections)), np.zeros(len(projections), dtype=np.int64)
    for _, stride in _looks(len(projections)):
        after += numbers % stride != 0
    return projections[np.argsort(after, kind="stable")]


@dataclass(frozen=True, eq=False)
class Prices:
    """What hiding too much costs, in sixteenths, as :mod:`simplifier.kernels.soup_views` counts.

    ``measure``  of a measure that is hidden wrongly, beside one hidden rightly.
    ``fines``    (V,) int64, or one for all views, of each pixel past the outline.
    ``tolls``    the same of each pixel in front.
    """

    measure: int
    fines: NDArray[np.int64] | int = 0
    tolls: NDArray[np.int64] | int = 0

    def by_view(self, count: int) -> NDArray[np.int64]:
        """(count, 2) the fine and the toll of each view."""
        both = np.empty((count, 2), dtype=np.int64)
        both[:, 0], both[:, 1] = self.fines, self.tolls
        return both


def score(triangles: FloatArray, views: RefineViews, prices: Prices) -> int:
    """What triangles (m, 3, 3) score, as a search that begins with them does."""
    fines = prices.by_view(len(views.projections))
    return _drawn_score(triangles, views, views.standing(), prices.measure, fines)


def score_of_original(views: RefineViews, prices: Prices) -> int:
    """What the original itself would score, 1 at least."""
    scores = np.empty(len(views.projections), dtype=np.int64)
    fines = prices.by_view(len(scores))
    return max(
        int(score_unions(views.originals, views.originals, prices.measure, fines, scores)), 1
    )


def _drawn_score(
    triangles: FloatArray, views: RefineViews, standing: Images, price: int,
    fines: NDArray[np.int64],
) -> int:  # fmt: skip
    """Of triangles (m, 3, 3) beside what is ``standing``, of which a copy is drawn into."""
    union, scores = standing.copy(), np.empty(len(standing), dtype=np.int64)
    draw_union(triangles, views.projections, views.depths.arrays(), union)
    return int(score_unions(union, views.originals, price, fines, scores))


def pull_each(triangles: FloatArray, room: Room) -> tuple[FloatArray, BoolArray]:
    """Draw in the triangles that leave a room: along their normals by two of its voxels at most,
    and towards their centres by as little as that takes.

    Returns them, (m, 3, 3), and which are in the room after that, (m,).
    """
    drawn = np.array(triangles, dtype=np.float64, order="C")
    inside = np.empty(len(drawn), dtype=np.bool_)
    steps = _SHIFTS * (room.shape[0] / room.layers.shape[0])
    pull_triangles(drawn, room.voxels, steps, _PULLS, _PULL, inside)
    return drawn, inside


class Annealing:
    """Simulated annealing of ``triangles`` (m, 3, 3) in grid space, m >= 1.

    Scores are whole numbers, those of :mod:`simplifier.kernels.soup_views`.  ``work`` (2,) int64
    counts the views that moves drew and those that they scored.  ``heat`` is :data:`ALONE`,
    :data:`TOGETHER` or more.
    """

    def __init__(
        self,
        triangles: FloatArray,
        room: Room,
        views: RefineViews,
        prices: Prices,
        seed: int,
        heat: float = ALONE,
    ) -> None:
        count = len(views.projections)
        self.room, self._views, self._depths = room, views, views.depths.arrays()
        self._heat = heat
        self._price, self._fines = -1, np.zeros((count, 2), dtype=np.int64)
        self._set(prices)
        self._start = triangles
        self._state = np.array([(2 * seed + 1) * 0x9E3779B97F4A7C15 % 2**64], dtype=np.uint64)
        self._triangles = np.array(triangles)
        self._standing = views.standing()
        self._images, self._layers = empty_pictures(len(triangles), count, views.rows)
        self._scores = np.zeros(count, dtype=np.int64)
        self._whole = float(score_of_original(views, prices))
        self.work = np.zeros(2, dtype=np.int64)
        self._best = self._triangles.copy()
        self._best_score = np.array([self._draw()], dtype=np.int64)

    @property
    def score(self) -> int:
        """That of the best yet."""
        return int(self._best_score[0])

    @property
    def measure(self) -> float:
        """That score as a share of what the original itself would have."""
        return max(self.score / self._whole, 0.0)

    def current(self) -> FloatArray:
        """(m, 3, 3) the triangles as they are, a copy."""
        return self._triangles.copy()

    def best(self) -> FloatArray:
        """(m, 3, 3) the triangles of that score, a copy."""
        return self._best.copy()

    def run(self, moves: int, shares: tuple[float, float]) -> None:
        """Try some moves; ``shares`` of the whole search begin and end."""
        whole = self._whole * min(1.0, _FEW / len(self._triangles))
        heats = (self._heat * whole, _LAST_HEAT * whole)
        length = max(self.room.shape) - 2.0 * self.room.margin
        steps = (_STEPS[0] * length, _STEPS[1] * length)
        anneal(
            self._triangles, self._views.projections, self._depths,
            self._views.originals,
            self._price, self._fines, self.room.voxels, self.room.cells_before,
            self._images, self._layers, self._scores, self._best, self._best_score,
            self._state, _looks(len(self._scores)), moves, shares, steps, heats, self.work,
        )  # fmt: skip

    def reprice(self, prices: Prices) -> None:
        """Go on with other prices; the best yet is judged anew."""
        if self._set(prices):
            now = self._score(self._union(), self._scores)
            is_best = np.array_equal(self._best, self._triangles)
            best = now if is_best else self._fresh(self._best)
            self._best_score[0] = max(best, now)
            if now >= best:
                self._best[:] = self._triangles

    def _set(self, prices: Prices) -> bool:
        """Whether these are others than before."""
        fines = prices.by_view(len(self._fines))
        if prices.measure == self._price and np.array_equal(fines, self._fines):
            return False
        self._price, self._fines = prices.measure, fines
        return True

    def move_to(self, room: Room) -> None:
        """Go on in another room: triangles that leave it are drawn in, as in :func:`pull_each`.

        In place of one that cannot be, another is copied; it is soon put elsewhere.
        """
        self.room = room
        drawn, inside = pull_each(self._triangles, room)
        if inside.any():
            others = np.flatnonzero(inside)
            places = np.flatnonzero(~inside)
            drawn[places] = drawn[others[np.arange(len(places)) % len(others)]]
        self._triangles[:] = drawn
        self._best_score[0] = self._draw()
        self._best[:] = self._triangles

    def take_from(self, others: FloatArray) -> None:
        """Put each of other triangles (k, 3, 3) where that raises the score, in place of one that
        is there."""
        take_from(
            others, self._triangles, self._views.projections, self._depths, self._views.originals,
            self._price, self._fines, self.room.voxels, self._images, self._layers, self._scores,
            self._best, self._best_score, _looks(len(self._scores)), self.work,
        )  # fmt: skip

    def precision(self) -> float:
        """Of the current state in the search's own views, all quads counted."""
        views, unions = self._views, self._union()[:, :64, None]
        return precision_and_recall(views.originals[:, :, None], unions, 64, views.full)[0]

    def overhang(self) -> FloatArray:
        """(V,) pixels of the current state past the outline, as a share of the original's."""
        originals, outside = self._views.originals, self._union()[:, :64] & ~self._views.originals
        there = np.bitwise_count(originals).sum(axis=1, dtype=np.int64)
        return np.asarray(np.bitwise_count(outside).sum(axis=1) / np.maximum(there, 1))

    def front(self) -> FloatArray:
        """(V,) pixels of the original before which the current state stands, as a share of all."""
        there = np.bitwise_count(self._views.originals).sum(axis=1, dtype=np.int64)
        before = np.bitwise_count(self._union()[:, 64:]).sum(axis=1, dtype=np.int64)
        return np.asarray(FRONT_STEP * before / np.maximum(there, 1))

    def result(self) -> FloatArray:
        """The best triangles, or those of the start if they score more; none that adds nothing."""
        if self._fresh(self._start) > self.score:
            self._best = np.array(self._start)
        self._triangles[:] = self._best
        self._draw()
        kept = np.zeros(len(self._best), dtype=np.bool_)
        remove_useless(
            self._images,
            self._layers,
            self._views.originals,
            self._price,
            self._fines,
            self._scores,
            kept,
        )
        return self._best[kept]

    def _draw(self) -> int:
        views = self._views.projections
        draw_soup(self._triangles, views, self._depths, self._standing, self._images, self._layers)
        return self._score(self._union(), self._scores)

    def _fresh(self, triangles: FloatArray) -> int:
        """The score of other triangles at the present prices."""
        return _drawn_score(triangles, self._views, self._standing, self._price, self._fines)

    def _union(self) -> Images:
        return self._layers[:, 0].copy()

    def _score(self, unions: Images, scores: NDArray[np.int64]) -> int:
        views = self._views.originals
        return int(score_unions(unions, views, self._price, self._fines, scores))
