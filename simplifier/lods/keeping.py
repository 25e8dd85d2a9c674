"""A level of detail, judged, and what it and the finer ones make of each other."""

from __future__ import annotations

from dataclasses import dataclass, replace

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import SLACK, deviation
from simplifier.geometry.lod_chain import LeftOut, Level
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.solid import Solid
from simplifier.lods.choice import HIDES_NOTHING, Figures, why_replaced, why_useless
from simplifier.options import Options
from simplifier.pipeline import Simplification

_VIEWS, _IMAGE = 64, 256  # that levels are compared by


@dataclass(frozen=True, eq=False)
class Kept:
    """A level of the chain; in ``solid`` its error bound holds."""

    level: Level
    solid: Solid
    figures: Figures


def judged(mesh: TriangleMesh, made: Simplification, options: Options) -> Kept:
    """Measure what was made with the options: deviation, precision, recall."""
    found = evaluate_accuracy(
        mesh, made.occluder,
        AccuracyOptions(
            _VIEWS, _IMAGE, seed=options.seed, exact=True, viewers=options.viewers,
            up=options.solid.up,
        ),
    )  # fmt: skip
    strays = _deviation(made.occluder, mesh, made.solid)
    level = Level(made.occluder, options.solid.resolution, strays)
    return Kept(level, made.solid, Figures(level.triangles, found.precision, found.recall))


def taken(kept: list[Kept], coarser: Kept, mesh: TriangleMesh) -> tuple[list[Kept], list[LeftOut]]:
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
    strays = _deviation(occluder, mesh, finer.solid)
    if strays + SLACK * finer.solid.filled.cell_size > bound:
        return None
    promised = replace(occluder, error_bound=bound)
    level = replace(coarser.level, occluder=promised, deviation=strays)
    return replace(coarser, level=level, solid=finer.solid)


def _deviation(occluder: Occluder, mesh: TriangleMesh, solid: Solid) -> float:
    return deviation(occluder, mesh, solid.touched, solid.filled)
