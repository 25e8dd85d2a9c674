"""Which of several occluders hides most, by finer pictures than a search can afford."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from simplifier.device.device import PROCESSOR, Device, soup_masks
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.overrides import NOTHING
from simplifier.kernels.coverage import MaskArray
from simplifier.kernels.front import pixels_before
from simplifier.kernels.overhang import count_beside, shares_beside, widen
from simplifier.kernels.random_quads import exact_quad_pixels, full_areas
from simplifier.kernels.threads import run_chunks, run_each
from simplifier.refinement.depths import NO_DEPTHS, Depths, with_depth

SIZE = 256
"""Pixels a side of the pictures for precision and recall, as in an accuracy report."""

OUTLINE = 512
"""Pixels a side of the pictures for overhang, as in an accuracy report."""

_WRONG = 2.0  # what a share hidden wrongly weighs beside one of recall
_SHORT = 20.0  # and that part of it which falls short of the aim, as well
DEAREST = _WRONG + _SHORT
"""What a share hidden wrongly weighs at most, beside one of recall."""

_BESIDE = 40.0  # what overhang past the aim weighs
_WORST = 10.0  # and what it has past twice the aim in the worst view
_BEFORE = 2.0  # what front past the aim weighs

MUCH = 0.7
"""Of recall, less all that: what is worth less may be too thin for what was tried."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """Pictures of the original in which overhang and front are counted.

    ``projections`` (V, 2, 4) to 512 x 512 pixels, ``wide`` (V, 512, 8) masks of what is at most a
    pixel away from the original, its own ``pixels`` (V,), and the triangles ``drawn`` (k, 3, 3) by
    hand, which count as the original's; and its ``depths`` in pictures of any size, or none, where
    no front is asked for.  The ``device`` draws.
    """

    projections: FloatArray
    wide: MaskArray
    pixels: NDArray[np.int64]
    drawn: FloatArray
    depths: Depths = NO_DEPTHS
    device: Device = PROCESSOR

    @classmethod
    def of(
        cls,
        vertices: FloatArray,
        faces: IntArray,
        projections: FloatArray,
        drawn: FloatArray = NOTHING,
        depths: Depths = NO_DEPTHS,
        device: Device = PROCESSOR,
    ) -> Outlines:
        """``projections`` (V, 2, 4) to 64 x 64 pixels, as a search has them."""
        fine = projections * (OUTLINE / 64)
        masks = device.coverage_masks(vertices, faces, fine, OUTLINE, OUTLINE)
        wide, pixels = np.empty_like(masks), np.empty(len(masks), dtype=np.int64)
        run_chunks(lambda begin, end: widen(masks, begin, end, wide, pixels), len(masks))
        return cls(fine, wide, pixels, drawn, depths, device)

    def front(self, triangles: FloatArray) -> FloatArray:
        """(V,) pixels of the original before which a soup (m, 3, 3) stands, as a share of all."""
        size = self.depths.limits.shape[1]
        maps = with_depth(self.projections * (size / OUTLINE), self.depths.away)
        there, before = pixels_before(self.depths.limits, triangles, maps).T
        return np.asarray(before / np.maximum(there, 1))

    def overhang(self, triangles: FloatArray) -> FloatArray:
        """(V,) pixels of a soup (m, 3, 3) beside the original, as a share of the original's."""
        together = np.concatenate([triangles, self.drawn])
        shown = soup_masks(self.device, together, self.projections, OUTLINE)
        beside = np.empty(len(shown), dtype=np.int64)
        count_beside(self.wide, shown, 0, len(shown), beside)
        return shares_beside(self.pixels, beside)


@dataclass(frozen=True, eq=False)
class FineViews:
    """``projections`` (V, 2, 4) to ``size`` pixels a side, the original's masks (V, size,
    size / 64), what of their quads is full (V,), and where overhang is counted."""

    projections: FloatArray
    originals: MaskArray
    full: FloatArray
    outlines: Outlines
    size: int = SIZE

    @classmethod
    def of(
        cls, vertices: FloatArray, faces: IntArray, projections: FloatArray, outlines: Outlines
    ) -> FineViews:
        """``projections`` (V, 2, 4) to 64 x 64 pixels, as a search has them."""
        fine = projections * (SIZE / 64)
        masks = outlines.device.coverage_masks(vertices, faces, fine, SIZE, SIZE)
        return cls(fine, masks, full_areas(masks, SIZE), outlines)

    def halved(self) -> FineViews:
        """The same by every other pixel of every other row: the original is not drawn again.

        Soups are drawn by the processor: few triangles take it less time than a card takes to
        answer, and many such pictures are asked for one after the other.
        """
        projections, size = self.projections / 2.0, self.size // 2
        projections[:, :, 3] += 0.25  # so that centres of pixels are those of the ones that stay
        masks = _every_other(self.originals)
        outlines = replace(self.outlines, device=PROCESSOR)
        return FineViews(projections, masks, full_areas(masks, size), outlines, size)


def _every_other(masks: MaskArray) -> MaskArray:
    """Pixel of the rows and columns 0, 2, 4, ...: (V, rows, words) to half of both."""
    pixels = np.unpackbits(masks.astype("<u8").view(np.uint8), axis=2, bitorder="little")
    fewer = np.packbits(pixels[:, ::2, ::2], axis=2, bitorder="little")
    return np.ascontiguousarray(fewer).view("<u8").astype(np.uint64)


@dataclass(frozen=True)
class FinalistScore:
    """Precision, recall, overhang and front in some views, all quads counted.

    ``overhang``  over all views, ``worst`` in the view with most.
    ``front``     over all views; 0 where nothing was asked of it.
    """

    precision: float
    recall: float
    overhang: float
    worst: float
    front: float = 0.0


def precision_and_recall(
    originals: MaskArray, shown: MaskArray, columns: int, full: FloatArray | None = None
) -> tuple[float, float]:
    """Of masks (V, rows, words); ``full`` (V,) are :func:`full_areas` of the originals, if known.

    Where nothing is hidden the precision is 1; where there is nothing to hide the recall is 0, so
    that what is too thin for any picture is no success.
    """
    pixels = exact_quad_pixels(originals, np.ascontiguousarray(shown), columns, full)
    right, missed, wrong = pixels.sum(axis=0)
    return (
        float(right / (right + wrong)) if right + wrong > 0.0 else 1.0,
        float(right / (right + missed)) if right + missed > 0.0 else 0.0,
    )


def score_finalist(
    triangles: FloatArray, views: FineViews, beside: FloatArray | None = None
) -> FinalistScore:
    """Judge a soup (m, 3, 3); none at all has precision 1, recall 0 and no overhang.

    ``beside`` (V,) is what :meth:`Outlines.overhang` counts of it, if known.
    """
    beside = views.outlines.overhang(triangles) if beside is None else beside
    together = np.concatenate([triangles, views.outlines.drawn])
    shown = soup_masks(views.outlines.device, together, views.projections, views.size)
    priced = views.outlines.depths.known
    before = float(views.outlines.front(triangles).mean()) if priced else 0.0
    return FinalistScore(
        *precision_and_recall(views.originals, shown, views.size, views.full),
        float(beside.mean()), float(beside.max()), before,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Judge:
    """Which occluder is best: the one with most recall, less what it hides wrongly, which weighs
    most past the aims.

    ``precision`` is to be had at least, ``overhang`` at most in the mean, and twice that in any
    view, and ``front`` at most in the mean.
    """

    views: FineViews
    precision: float
    overhang: float = 1.0
    _known: list[tuple[FloatArray, FinalistScore]] = field(default_factory=list)
    front: float = 1.0

    def best_of(
        self,
        soups: Sequence[FloatArray],
        spare: Callable[[], Sequence[FloatArray]] = tuple,
        much: float = MUCH,
    ) -> FloatArray:
        """The first of equals, so that what is refined comes before what is not.

        Where the best is worth less than ``much``, what ``spare`` makes and nothing at all compete
        with it, and come before equals: none of the pictures may show what is thin.
        """
        judged = self.worths(soups)
        if max(judged, default=0.0) < much:
            others = [*spare(), NOTHING]
            soups, judged = [*others, *soups], [*self.worths(others), *judged]
        return soups[judged.index(max(judged))]

    def worths(self, soups: Sequence[FloatArray]) -> list[float]:
        """Of each soup; several are judged at the same time, since one leaves cores idle."""
        run_each(self.score, soups)
        return [self.worth(soup) for soup in soups]

    def worth(self, triangles: FloatArray) -> float:
        """Of a soup (m, 3, 3): its recall, less what its faults cost; 0 of none."""
        return self.worth_of(self.score(triangles))

    def worth_of(self, found: FinalistScore) -> float:
        """The same of what pictures have shown."""
        return found.recall - self.faults_of(found)

    def faults_of(self, found: FinalistScore) -> float:
        """What they cost."""
        short = max(self.precision - found.precision, 0.0)
        before = max(found.front - self.front, 0.0)
        lost = _WRONG * (1.0 - found.precision) + _SHORT * short + _BEFORE * before
        return lost + self._price(found.overhang, found.worst)

    def score_above(self, least: float, triangles: FloatArray) -> FinalistScore | None:
        """Where it makes a worth of more than ``least``, of a soup that nobody asks for again.

        Overhang is counted first, which takes a third of the time, and often is too much, however
        much is hidden.
        """
        beside = self.views.outlines.overhang(triangles)
        if 1.0 - self._price(float(beside.mean()), float(beside.max())) <= least:
            return None
        found = score_finalist(triangles, self.views, beside)
        return found if self.worth_of(found) > least else None

    def coarser(self) -> Judge:
        """One whose pictures for precision and recall have half as many pixels a side, for soups
        that differ by little."""
        return Judge(self.views.halved(), self.precision, self.overhang, front=self.front)

    def _price(self, overhang: float, worst: float) -> float:
        """What overhang past the aims costs."""
        beside, too_much = max(overhang - self.overhang, 0.0), max(worst - 2.0 * self.overhang, 0.0)
        return _BESIDE * beside + _WORST * too_much

    def recall(self, triangles: FloatArray) -> float:
        """Of a soup (m, 3, 3), whatever its faults."""
        return self.score(triangles).recall

    def score(self, triangles: FloatArray) -> FinalistScore:
        """Of a soup (m, 3, 3), whose pictures are drawn once, however often it is judged."""
        for soup, found in self._known:
            if soup is triangles:
                return found
        found = score_finalist(triangles, self.views)
        self._known.append((triangles, found))
        return found
