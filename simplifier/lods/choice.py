"""Which levels of detail bring something: none that another could stand in for.

At a distance the levels that count are those whose error is small enough there, and each costs its
triangles and hides its share.  A level is in the chain when at some distance no other one that
counts there is as good:

- one that hides nothing is left out;
- a coarser level counts only where the finer one does, too: so it has to be cheaper by a tenth of
  the triangles, or to hide more;
- a finer level is there for its smaller error.  Where the coarser one is cheaper and hides as much
  and as rightly, and was measured to keep the finer one's error bound, it takes over that bound and
  the finer one is left out.

Recall and precision are shares of what there is to hide, so they do not depend on the distance.

A level of detail, judged, and what it and the finer ones make of each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import SLACK, deviation_from_solid
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import LeftOut, Level
from simplifier.geometry.solid import Solid
from simplifier.options.stages import Options
from simplifier.pipeline import Simplification
from simplifier.wording import percent

HIDES_MORE = 0.005
"""Recall that counts as a difference: about what two seeds of a search differ by."""

MORE_RIGHTLY = 0.001
"""Precision that counts as a difference."""

CHEAPER = 0.9
"""A level is cheaper when it has at most this share of the triangles."""


HIDES_NOTHING = "it hides nothing"


@dataclass(frozen=True)
class LevelFigures:
    """What a level costs and gives; ``precision`` and ``recall`` from 0 to 1."""

    triangles: int
    precision: float
    recall: float

    @property
    def hides(self) -> bool:
        """Whether it hides anything to speak of."""
        return self.triangles > 0 and self.recall > HIDES_MORE


def why_useless(coarser: LevelFigures, finer: LevelFigures) -> str:
    """Why the coarser level brings nothing beside the finer one; empty when it does."""
    if not coarser.hides:
        return HIDES_NOTHING
    if _cheaper(coarser, finer) or coarser.recall > finer.recall + HIDES_MORE:
        return ""
    return (
        f"{coarser.triangles} triangles for {finer.triangles} and a recall of "
        f"{percent(coarser.recall)} for {percent(finer.recall)}: no better than the finer level"
    )


def why_replaced(finer: LevelFigures, coarser: LevelFigures) -> str:
    """Why the finer level brings nothing once the coarser keeps its error bound; or empty."""
    as_good = (
        coarser.recall >= finer.recall - HIDES_MORE
        and coarser.precision >= finer.precision - MORE_RIGHTLY
    )
    if not _cheaper(coarser, finer) or not as_good:
        return ""
    return (
        f"the coarser level of {coarser.triangles} triangles for {finer.triangles} keeps its error"
        f" bound, with a recall of {percent(coarser.recall)} for {percent(finer.recall)}"
    )


def _cheaper(coarser: LevelFigures, finer: LevelFigures) -> bool:
    return coarser.triangles <= CHEAPER * finer.triangles


_VIEWS, _IMAGE = 64, 256  # that levels are compared by


@dataclass(frozen=True, eq=False)
class Kept:
    """A level of the chain; in ``solid`` its error bound holds."""

    level: Level
    solid: Solid
    figures: LevelFigures


def judge_level(mesh: TriangleMesh, made: Simplification, options: Options) -> Kept:
    """Measure what was made with the options: deviation, precision, recall."""
    found = evaluate_accuracy(
        mesh, made.occluder,
        AccuracyOptions(
            _VIEWS, _IMAGE, seed=options.seed, exact=True, viewers=options.solid.viewers,
            up=options.solid.up,
        ),
    )  # fmt: skip
    strays = deviation_from_solid(made.occluder, mesh, made.solid)
    level = Level(made.occluder, options.solid.resolution, strays)
    return Kept(level, made.solid, LevelFigures(level.triangles, found.precision, found.recall))


def add_coarser(
    kept: list[Kept], coarser: Kept, mesh: TriangleMesh
) -> tuple[list[Kept], list[LeftOut]]:
    """The levels kept so far, finest first, and a coarser one: those to keep, and those to leave.

    The rule is that of :mod:`simplifier.lods.choice`.
    """
    finer = list(kept)
    left_out: list[LeftOut] = []
    while finer:
        reason = why_useless(coarser.figures, finer[-1].figures)
        if reason:
            return finer, [*left_out, LeftOut(coarser.level.resolution, reason)]
        if not finer[-1].figures.hides:
            reason = HIDES_NOTHING
        else:
            reason = why_replaced(finer[-1].figures, coarser.figures)
            heir = _heir(finer[-1], coarser, mesh) if reason else None
            if heir is None:
                break
            coarser = heir
        left_out.append(LeftOut(finer.pop().level.resolution, reason))
    return [*finer, coarser], left_out


def _heir(finer: Kept, coarser: Kept, mesh: TriangleMesh) -> Kept | None:
    """The coarser level with the finer one's error bound, if it was measured to keep it.

    Measured in the finer solid: what the coarser grid encloses is not all inside there.
    """
    bound, occluder = finer.level.error_bound, coarser.level.occluder
    strays = deviation_from_solid(occluder, mesh, finer.solid)
    if strays + SLACK * finer.solid.filled.cell_size > bound:
        return None
    promised = replace(occluder, error_bound=bound)
    level = replace(coarser.level, occluder=promised, deviation=strays)
    return replace(coarser, level=level, solid=finer.solid)
