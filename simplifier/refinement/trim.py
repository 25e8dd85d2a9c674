"""Triangles with more faults than were asked for -> the same, some of them cut back.

What sticks out, or hides wrongly, belongs to few of the triangles, and to a corner or an edge of
these.  A price for it moves them all, and a narrower room draws them all in.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.kernels.coverage import MaskArray
from simplifier.kernels.overhang import weigh_each
from simplifier.kernels.threads import run_chunks
from simplifier.refinement.finalists import Judge, Outlines

_FAULTS = 0.03  # of recall, that make cutting back worth its time
_PASSES = 1.1  # times the overhang asked for: no more is cut back, since a report shows less
_STEP = 0.06  # of the way from a corner to the opposite edge, or from an edge to its corner
_STEPS = 12  # that a triangle is cut back by, at most
_SOME = slice(None, None, 3)  # of the views: enough to tell what a triangle covers
_LEAST = 1e-7  # of a silhouette that a step costs: one that costs nothing comes first
_PARTS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)  # of all steps, to hide less wrongly

_Weigh = Callable[[FloatArray], FloatArray]
"""Of a soup (m, 3, 3) to (m, 2): the fault of each triangle, and what it covers of the original,
shares of the original in the mean of views."""


@dataclass(frozen=True, eq=False)
class _Pictures:
    """Of the original, beside which triangles are weighed.

    ``projections`` (V, 2, 4), ``masks`` (V, rows, words) of where there is no fault, and the
    ``pixels`` (V,) of the original.
    """

    projections: FloatArray
    masks: MaskArray
    pixels: NDArray[np.int64]

    @classmethod
    def of(cls, outlines: Outlines, views: slice | NDArray[np.int64]) -> _Pictures:
        """Some views of the outlines, beside which triangles stick out."""
        return cls(
            np.ascontiguousarray(outlines.projections[views]),
            np.ascontiguousarray(outlines.wide[views]), outlines.pixels[views],
        )  # fmt: skip

    def weigh(self, triangles: FloatArray) -> FloatArray:
        """As :data:`_Weigh`, where the fault is to cover what is not in the masks."""
        weights = 1.0 / np.maximum(self.pixels, 1) / len(self.pixels)
        by_number = np.ascontiguousarray(triangles.transpose(0, 2, 1))
        weighed = np.empty((len(triangles), 2))

        def weigh(begin: int, end: int) -> None:
            weigh_each(by_number, self.projections, self.masks, weights, begin, end, weighed)

        run_chunks(weigh, len(triangles))
        return weighed


@dataclass(frozen=True, eq=False)
class _Step:
    """A triangle (3, 3) that lies in the one that it replaces.

    ``gain``  the fault that goes for what is covered less, or that of an earlier step of the same
              triangle, if less: the steps of a triangle are taken in turn.
    """

    gain: float
    place: int
    triangle: FloatArray


def is_worth_cutting(triangles: FloatArray, chosen: FloatArray, judge: Judge) -> bool:
    """Whether more of a soup (m, 3, 3) sticks out than passes, and without its faults it would be
    worth far more than what is ``chosen``.

    More may stick out in one view alone.  Where that soup is chosen all the same, cutting it back
    for that view would take away far more in others.
    """
    score, most = judge.score(triangles), _PASSES * judge.overhang
    one_view = triangles is not chosen and score.worst > 2.0 * most
    if score.overhang <= most and not one_view:
        return False
    return score.recall - judge.worth(chosen) >= _FAULTS


def trimmed(triangles: FloatArray, judge: Judge) -> list[FloatArray]:
    """Soups that stick out less than one of (m, 3, 3), and hide less: by no more than the judge's
    overhang in the mean of its views, and then by no more than twice that in each.

    Each triangle that sticks out is cut back in small steps, the best by what it takes away of that
    for what it covers less, until it sticks out no more or is gone.  The steps of all are taken in
    that order until enough is gone.  What is cut back lies in what it was, so it keeps to its room.
    """
    outlines, soups = judge.views.outlines, []
    some = _Pictures.of(outlines, _SOME)
    if judge.score(triangles).overhang > judge.overhang:
        triangles = _cut_until(
            triangles, outlines, some.weigh, lambda left: bool(left.mean() <= judge.overhang)
        )
        soups.append(triangles)
    shares, most = outlines.overhang(triangles), 2.0 * judge.overhang
    if shares.max() > most:
        worst = _Pictures.of(outlines, np.flatnonzero(shares > most))

        def weigh(soup: FloatArray) -> FloatArray:
            return np.stack([worst.weigh(soup)[:, 0], some.weigh(soup)[:, 1]], axis=1)

        triangles = _cut_until(triangles, outlines, weigh, lambda left: bool(left.max() <= most))
        soups.append(triangles)
    return soups


def made_precise(triangles: FloatArray, judge: Judge) -> list[FloatArray]:
    """Soups that hide ever less wrongly than one of (m, 3, 3), and hide less.

    They are cut back as by :func:`trimmed`, but where they cover what the original does not, by the
    judge's finer pictures.  How much of that is wrong, pixels alone do not tell: a picture counts
    what it hides by rectangles.
    """
    views = judge.views
    pixels = np.bitwise_count(views.originals).sum(axis=(1, 2), dtype=np.int64)
    steps = _steps(triangles, _Pictures(views.projections, views.originals, pixels).weigh)
    if not steps:
        return []
    cut = (_after(triangles, steps[: int(part * len(steps))]) for part in _PARTS)
    return [left for left in cut if len(left) > 0]


def _cut_until(
    triangles: FloatArray,
    outlines: Outlines,
    weigh: _Weigh,
    enough: Callable[[FloatArray], bool],
) -> FloatArray:
    """Cut back what sticks out, as ``weigh`` tells, until what is left in all is ``enough``."""
    steps = _steps(triangles, weigh)
    low, high = 0, len(steps)
    while high - low > 1:  # each step leaves less
        middle = (low + high) // 2
        if enough(outlines.overhang(_after(triangles, steps[:middle]))):
            high = middle
        else:
            low = middle
    return _after(triangles, steps[:high])


def _steps(triangles: FloatArray, weigh: _Weigh) -> list[_Step]:
    """Of all triangles with a fault, the best first, and those of a triangle in turn."""
    now, steps = triangles.copy(), []
    least = np.full(len(now), np.inf)
    shares = weigh(now)
    rest = np.flatnonzero(shares[:, 0] > 0.0)
    for _ in range(_STEPS):
        if len(rest) == 0:
            break
        forms = _cut_back(now[rest])
        weighed = weigh(forms.reshape(-1, 3, 3)).reshape(*forms.shape[:2], 2)
        beside, covered = np.moveaxis(shares[rest, None] - weighed, -1, 0)
        gains = np.where(beside > 0.0, beside / np.maximum(covered, _LEAST), 0.0)
        chosen = np.arange(len(rest)), gains.argmax(axis=1)
        now[rest], shares[rest] = forms[chosen], weighed[chosen]
        least[rest] = np.minimum(least[rest], gains[chosen])
        rest = rest[gains[chosen] > 0.0]
        steps += [_Step(float(least[one]), int(one), now[one].copy()) for one in rest]
        rest = rest[shares[rest, 0] > 0.0]
    return sorted(steps, key=lambda step: (-step.gain, step.place))


def _after(triangles: FloatArray, steps: Sequence[_Step]) -> FloatArray:
    """The soup with those steps taken, without what is gone by then."""
    cut = triangles.copy()
    for step in steps:
        cut[step.place] = step.triangle
    return np.ascontiguousarray(cut[(cut != cut[:, :1]).any(axis=(1, 2))])


def _cut_back(triangles: FloatArray) -> FloatArray:
    """(m, 7, 3, 3): each corner a step towards the middle of the opposite edge, each edge a step
    towards the opposite corner, and nothing."""
    forms = np.repeat(triangles[:, None], 7, axis=1)
    for corner in range(3):
        others = [(corner + 1) % 3, (corner + 2) % 3]
        here, ends = triangles[:, corner], triangles[:, others]
        forms[:, corner, corner] += _STEP * (ends.mean(axis=1) - here)
        forms[:, 3 + corner, others] += _STEP * (here[:, None] - ends)
    forms[:, 6] = triangles[:, :1]
    return forms
