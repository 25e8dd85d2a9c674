"""One search: a triangle soup, its pictures, and the moves that improve it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.overrides import NOTHING
from simplifier.geometry.solid import BoolArray
from simplifier.kernels.annealing import anneal
from simplifier.kernels.soup_views import (
    block_count,
    draw_soup,
    remove_useless,
    score_unions,
    unite_others,
)
from simplifier.refinement.finalists import FinalistScore

_STEPS = (6.0, 0.1)  # voxels that a move spans at first and at last
_HEATS = (1e-3, 2e-5)  # losses taken at first and at last, as shares of the original's measure
_FEW = 50  # triangles up to which a move is as hot; each of more has less to lose

Images = NDArray[np.uint64]


@dataclass(frozen=True, eq=False)
class RefineViews:
    """What the search looks at.

    ``projections``  (V, 2, 4).
    ``originals``    (V, 64) the original's bits, those of the drawn triangles among them.
    ``drawn``        (k, 3, 3) triangles that hide too, whatever the search does; may be none.
    """

    projections: FloatArray
    originals: Images
    drawn: FloatArray = field(default_factory=lambda: NOTHING)

    def standing(self) -> Images:
        """(b, V, 64) the picture of the drawn triangles, as a block of a soup; none without any."""
        images = np.zeros((len(self.drawn), len(self.projections), 64), dtype=np.uint64)
        blocks = np.zeros((block_count(len(images)), *images.shape[1:]), dtype=np.uint64)
        draw_soup(np.array(self.drawn), self.projections, images, blocks)
        return np.bitwise_or.reduce(blocks, axis=0, keepdims=True)[: len(blocks)]


@dataclass(frozen=True, eq=False)
class Room:
    """Where triangles may be: ``allowed`` (nx, ny, nz) bool voxels.

    ``before`` (nx ny + 1,) int64: allowed voxels in the columns along z before each one, and in
    all.  A table of the voxels themselves would take more memory than all else in a fine grid.
    """

    allowed: BoolArray
    before: NDArray[np.int64]

    @classmethod
    def of(cls, allowed: BoolArray) -> Room:
        counts = np.count_nonzero(allowed, axis=2).ravel()
        return cls(allowed, np.concatenate([[0], np.cumsum(counts)]).astype(np.int64))


class Annealing:
    """Simulated annealing of ``triangles`` (m, 3, 3) in grid space, m >= 1.

    ``price`` is what a measure hidden wrongly costs, in sixteenths of one hidden rightly.  Scores
    are whole numbers, those of :mod:`simplifier.kernels.soup_views`.  ``work`` (2,) int64 counts
    the views that moves drew and those that they scored.
    """

    def __init__(
        self, triangles: FloatArray, room: Room, views: RefineViews, price: int, seed: int
    ) -> None:
        count = len(views.projections)
        self._room, self._views, self._price = room, views, price
        self._start = triangles
        self._state = np.array([(2 * seed + 1) * 0x9E3779B97F4A7C15 % 2**64], dtype=np.uint64)
        self._triangles = np.array(triangles)
        self._images = np.zeros((len(triangles), count, 64), dtype=np.uint64)
        own = np.zeros((block_count(len(triangles)), count, 64), dtype=np.uint64)
        self._blocks = np.concatenate([own, views.standing()])
        self._scores = np.zeros(count, dtype=np.int64)
        self._whole = float(max(self._score(views.originals, self._scores), 1))
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

    def best(self) -> FloatArray:
        """(m, 3, 3) the triangles of that score, a copy."""
        return self._best.copy()

    def run(self, moves: int, shares: tuple[float, float]) -> None:
        """Try some moves; ``shares`` of the whole search begin and end."""
        heat = self._whole * min(1.0, _FEW / len(self._triangles))
        heats = (_HEATS[0] * heat, _HEATS[1] * heat)
        anneal(
            self._triangles, self._views.projections, self._views.originals, self._price,
            self._room.allowed, self._room.before, self._images, self._blocks, self._scores,
            self._best, self._best_score, self._state, moves, shares, _STEPS, heats, self.work,
        )  # fmt: skip

    def reprice(self, price: int) -> None:
        """Go on with another price; the best yet is judged anew."""
        if price == self._price:
            return
        self._price = price
        best = self._fresh(self._best)
        now = self._score(self._union(), self._scores)
        self._best_score[0] = max(best, now)
        if now >= best:
            self._best[:] = self._triangles

    def adopt(self, other: Annealing) -> None:
        """Go on from the current state of another search of as many triangles and that price."""
        for mine, its in (
            (self._triangles, other._triangles), (self._images, other._images),
            (self._blocks, other._blocks), (self._scores, other._scores),
            (self._best, other._best), (self._best_score, other._best_score),
        ):  # fmt: skip
            mine[:] = its

    def precision(self) -> float:
        """Of the current state in the search's own views, all quads counted."""
        originals, unions = self._views.originals[:, :, None], self._union()[:, :, None]
        return FinalistScore.of(originals, unions, 64).precision

    def result(self) -> FloatArray:
        """The best triangles, or those of the start if they score more; none that adds nothing."""
        if self._fresh(self._start) > self.score:
            self._best = np.array(self._start)
        self._triangles[:] = self._best
        self._draw()
        kept = np.zeros(len(self._best), dtype=np.bool_)
        remove_useless(
            self._images, self._blocks, self._views.originals, self._price, self._scores, kept
        )
        return self._best[kept]

    def _draw(self) -> int:
        draw_soup(self._triangles, self._views.projections, self._images, self._blocks)
        return self._score(self._union(), self._scores)

    def _fresh(self, triangles: FloatArray) -> int:
        """The score of other triangles at the present price."""
        images, blocks = np.empty_like(self._images), self._blocks.copy()
        draw_soup(triangles, self._views.projections, images, blocks)
        unions = np.bitwise_or.reduce(blocks, axis=0)
        return self._score(unions, np.empty_like(self._scores))

    def _union(self) -> Images:
        unions = np.empty_like(self._views.originals)
        unite_others(-1, self._images, self._blocks, unions)
        return unions

    def _score(self, unions: Images, scores: NDArray[np.int64]) -> int:
        return int(score_unions(unions, self._views.originals, self._price, scores))
