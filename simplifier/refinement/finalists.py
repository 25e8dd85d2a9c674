"""Which of several occluders hides most, by finer pictures than a search can afford."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.overrides import NOTHING
from simplifier.kernels.coverage import MaskArray, coverage_masks
from simplifier.kernels.random_quads import exact_quad_pixels

SIZE = 256
"""Pixels a side, as in an accuracy report."""

_WRONG = 2.0  # what a share hidden wrongly weighs beside one of recall
_SHORT = 20.0  # and that part of it which falls short of the aim, as well
_MUCH = 0.7  # of recall, less all that: what is worth less may be too thin for what was tried


@dataclass(frozen=True, eq=False)
class FineViews:
    """``projections`` (V, 2, 4) to 256 x 256 pixels, and the original's masks (V, 256, 4)."""

    projections: FloatArray
    originals: MaskArray

    @classmethod
    def of(cls, vertices: FloatArray, faces: IntArray, projections: FloatArray) -> FineViews:
        """``projections`` (V, 2, 4) to 64 x 64 pixels, as a search has them."""
        fine = projections * (SIZE / 64)
        return cls(fine, coverage_masks(vertices, faces, fine, SIZE, SIZE))


@dataclass(frozen=True)
class FinalistScore:
    """Precision and recall in some views, all quads counted.

    Where nothing is hidden the precision is 1; where there is nothing to hide the recall is 0, so
    that what is too thin for any picture is no success.
    """

    precision: float
    recall: float

    @classmethod
    def of(cls, originals: MaskArray, shown: MaskArray, columns: int) -> FinalistScore:
        """Of masks (V, rows, words)."""
        right, missed, wrong = exact_quad_pixels(originals, shown, columns).sum(axis=0)
        return cls(
            float(right / (right + wrong)) if right + wrong > 0.0 else 1.0,
            float(right / (right + missed)) if right + missed > 0.0 else 0.0,
        )


def score_finalist(triangles: FloatArray, views: FineViews) -> FinalistScore:
    """Judge a soup (m, 3, 3); none at all has precision 1 and recall 0."""
    corners = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    shown = coverage_masks(triangles.reshape(-1, 3), corners, views.projections, SIZE, SIZE)
    return FinalistScore.of(views.originals, shown, SIZE)


def best_of(
    soups: Sequence[FloatArray],
    views: FineViews,
    precision: float,
    spare: Callable[[], Sequence[FloatArray]] = tuple,
    drawn: FloatArray = NOTHING,
) -> FloatArray:
    """The soup with most recall, less what it hides wrongly, which weighs most below the aim.

    The first of equals, so that what is refined comes before what is not.  Where that is worth
    little, what ``spare`` makes and nothing at all compete with it, and come before equals: none
    of the pictures may show what is thin.  ``drawn`` (k, 3, 3) triangles hide too, whichever it is.
    """

    def worths(some: Sequence[FloatArray]) -> list[float]:
        shown = (np.concatenate([soup, drawn]) for soup in some)
        return [_worth(score_finalist(soup, views), precision) for soup in shown]

    judged = worths(soups)
    if max(judged, default=0.0) < _MUCH:
        others = [*spare(), NOTHING]
        soups, judged = [*others, *soups], [*worths(others), *judged]
    return soups[judged.index(max(judged))]


def _worth(found: FinalistScore, precision: float) -> float:
    short = max(precision - found.precision, 0.0)
    return found.recall - _WRONG * (1.0 - found.precision) - _SHORT * short
