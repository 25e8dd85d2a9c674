"""TriangleMesh -> LodChain: each level made by itself (paper section 4), the useless left out.

At a distance the levels that count are those whose error is small enough there, and each costs its
triangles and hides its share.  A level is in the chain when at some distance no other one that
counts there is as good:

- one that hides nothing is left out;
- a coarser level counts only where the finer one does, too: so it has to be cheaper by a tenth of
  the triangles, or to hide more;
- a finer level is there for its smaller error.  Where the coarser one is cheaper and hides as much
  and as rightly, sticks out no more than that or than was asked for, and was measured to keep the
  finer one's error bound, it takes over that bound and the finer one is left out.

Recall and precision are shares of what there is to hide, so they do not depend on the distance.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.deviation import SLACK, deviation_from_solid
from simplifier.accuracy.overhang import measure_overhangs
from simplifier.device.choice import open_device
from simplifier.device.device import Device
from simplifier.device.remembering import remembering, rest
from simplifier.errors import CancelledError
from simplifier.geometry.mesh import FloatArray, TriangleMesh
from simplifier.geometry.occluder import LeftOut, Level, LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.solid import Solid
from simplifier.lods.level_plan import LodPlan
from simplifier.options.stages import ERROR_VOXELS, Options
from simplifier.pipeline import Simplification, simplify_mesh
from simplifier.progress import Cancel, Deadline, Listener, Progress, Stopwatch, check_run
from simplifier.wording import count, percent

_JUDGING = 0.1  # of what a time limit leaves: for judging levels, until it is known what that takes
_LEAST_SECONDS = 1e-3


@dataclass(frozen=True, eq=False)
class Levels:
    """A chain, the solid of its finest level, and what the user should know.

    ``solid``        in which the finest level keeps its error bound.
    ``timings``      seconds by stage over all levels, those that were left out among them.
    ``interrupted``  whether the run was cancelled, so that these are the levels so far.
    ``decisions``    what was decided on the way to the finest, a sentence each.
    """

    chain: LodChain
    solid: Solid
    warnings: tuple[str, ...]
    timings: Mapping[str, float]
    interrupted: bool = False
    decisions: tuple[str, ...] = ()

    @property
    def occluder(self) -> Occluder:
        """The finest level's."""
        return self.chain.levels[0].occluder


def simplify_levels(
    mesh: TriangleMesh,
    plan: LodPlan,
    listener: Listener | None = None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
) -> Levels:
    """Make every level of the plan and keep those that bring something, finest first.

    The rule is that of the module; a level's budget is never above the triangles
    of the level before.  ``listener`` hears the stages of each level, with its number.  ``cancel``
    ends the run with the levels so far, and as :func:`~simplifier.pipeline.simplify_mesh` does
    while the finest is made.  A time limit is shared out by resolution.
    """
    check_run(listener, cancel)
    making = _Making(mesh, plan, listener, cancel, overrides)
    for index in range(len(plan.levels)):
        reason = making.why_not()
        if reason:
            making.leave_out(plan.levels[index].solid.resolution, reason)
        else:
            making.make(index)
    return making.result()


@dataclass(eq=False)
class _Making:
    """A run through the plan: what it was given, and what there is so far."""

    mesh: TriangleMesh
    plan: LodPlan
    listener: Listener | None
    cancel: Cancel | None
    overrides: Overrides
    kept: list[Kept] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    warnings: tuple[str, ...] = ()
    timings: dict[str, float] = field(default_factory=dict)
    interrupted: bool = False
    decisions: tuple[str, ...] = ()
    judging: float = 0.0  # seconds, of the last level

    def __post_init__(self) -> None:
        self.begin = time.perf_counter()
        self.deadline = Deadline.after(self.plan.levels[0].time_limit)
        self.device = remembering(open_device(self.plan.levels[0].device))

    def why_not(self) -> str:
        """Why no further level can be made; empty when it can."""
        if self.interrupted:
            return "interrupted before it was made"
        return "the time limit was up" if self.kept and self.deadline.is_up else ""

    def leave_out(self, resolution: int, reason: str) -> None:
        self.left_out.append(LeftOut(resolution, reason))

    def make(self, index: int) -> None:
        """Make one level, judge it, and take it into the chain if it belongs there."""
        options, listener = self._options(index), self._listener(index)
        try:
            made = simplify_mesh(self.mesh, options, listener, self.cancel, self.overrides)
        except CancelledError:
            if not self.kept:
                raise
            self.interrupted = True
            self.leave_out(options.solid.resolution, self.why_not())
            return
        self.interrupted = made.interrupted
        self.decisions = self.decisions or made.decisions
        if not self.kept or made.interrupted:
            self.warnings = tuple(dict.fromkeys([*self.warnings, *made.warnings]))
        watch = Stopwatch(listener)
        with watch.stage("accuracy"):
            level = judge_level(self.mesh, made, options, self.device)
            rest(self.device)
            self.kept, left_out = add_coarser(self.kept, level, self.mesh, self.device)
            self.left_out += left_out
        self.judging = watch.timings["accuracy"]
        for timings in (made.occluder.timings, watch.timings):
            for stage, seconds in timings.items():
                self.timings[stage] = self.timings.get(stage, 0.0) + seconds

    def result(self) -> Levels:
        levels = tuple(one.level for one in self.kept)
        left_out = sorted([*self.left_out, *self.plan.left_out], key=lambda one: -one.resolution)
        chain = LodChain(levels, self.plan.lens, self.plan.pixel_error, tuple(left_out))
        return Levels(
            chain, self.kept[0].solid, self.warnings, self.timings, self.interrupted, self.decisions
        )

    def _options(self, index: int) -> Options:
        """Those of the plan, with the budget and the time that are left."""
        options = self.plan.levels[index]
        before = self.kept[-1].level.triangles if self.kept else 0
        if before > 0:
            budget = min(options.selection.budget, max(before, len(self.overrides.triangles)))
            options = replace(options, selection=replace(options.selection, budget=budget))
        if not self.deadline.limited:
            return options
        left = [level.solid.resolution for level in self.plan.levels[index:]]
        judging = self.judging * len(left) if self.kept else _JUDGING * self.deadline.left
        seconds = max(self.deadline.left - judging, 0.0) * left[0] / sum(left)
        return replace(options, time_limit=max(seconds, _LEAST_SECONDS))

    def _listener(self, index: int) -> Listener | None:
        """The caller's, told which level this is and the time of the whole run."""
        listener, count = self.listener, len(self.plan.levels)
        if listener is None:
            return None

        def tell(progress: Progress) -> None:
            seconds = time.perf_counter() - self.begin
            listener(replace(progress, seconds=seconds, level=index, levels=count))

        return tell


HIDES_MORE = 0.005
"""Recall that counts as a difference: about what two seeds of a search differ by."""

MORE_RIGHTLY = 0.001
"""Precision that counts as a difference, and overhang."""

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
        f"{count(coarser.triangles, 'triangle')} for {finer.triangles:,} and a recall of "
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
        f"the coarser level of {count(coarser.triangles, 'triangle')} for {finer.triangles:,} keeps"
        f" its error bound, with a recall of {percent(coarser.recall)} for {percent(finer.recall)}"
    )


def _cheaper(coarser: LevelFigures, finer: LevelFigures) -> bool:
    return coarser.triangles <= CHEAPER * finer.triangles


_VIEWS, _IMAGE = 64, 256  # that levels are compared by


@dataclass(frozen=True, eq=False)
class Kept:
    """A level of the chain; in ``solid`` its error bound holds.

    ``directions``  (V, 3) the lines of sight that it was judged along.
    ``overhang``    what was asked for.
    """

    level: Level
    solid: Solid
    figures: LevelFigures
    directions: FloatArray
    overhang: float


def judge_level(mesh: TriangleMesh, made: Simplification, options: Options, device: Device) -> Kept:
    """Measure what was made with the options: deviation, precision, recall."""
    found = evaluate_accuracy(
        mesh, made.occluder,
        AccuracyOptions(
            _VIEWS, _IMAGE, seed=options.seed, exact=True, viewers=options.solid.viewers,
            up=options.solid.up,
        ),
        device=device,
    )  # fmt: skip
    strays = deviation_from_solid(made.occluder, mesh, made.solid)
    level = Level(made.occluder, options.solid.resolution, strays)
    figures = LevelFigures(level.triangles, found.precision, found.recall)
    return Kept(level, made.solid, figures, found.directions, options.refine.overhang)


def add_coarser(
    kept: list[Kept], coarser: Kept, mesh: TriangleMesh, device: Device
) -> tuple[list[Kept], list[LeftOut]]:
    """The levels kept so far, finest first, and a coarser one: those to keep, and those to leave.

    The rule is that of the module.
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
            heir = _heir(finer[-1], coarser, mesh, device) if reason else None
            if heir is None:
                break
            coarser = heir
        left_out.append(LeftOut(finer.pop().level.resolution, reason))
    if finer and coarser.level.error_bound <= finer[-1].level.error_bound:
        coarser = _by_its_grid(coarser)
    return [*finer, coarser], left_out


def _by_its_grid(kept: Kept) -> Kept:
    """The level with the error bound of any in its grid.

    Where a time limit left the finer one unrefined, the coarser one may be proved to stray less.
    With that bound it would be drawn wherever the finer one may be, though it hides less.
    """
    bound = ERROR_VOXELS * kept.solid.core.cell_size
    occluder = replace(kept.level.occluder, error_bound=bound)
    return replace(kept, level=replace(kept.level, occluder=occluder))


def _heir(finer: Kept, coarser: Kept, mesh: TriangleMesh, device: Device) -> Kept | None:
    """The coarser level with the finer one's error bound, if it was measured to keep it, and sticks
    out by no more.

    Measured in the finer solid: what the coarser grid encloses is not all inside there.
    """
    bound, occluder = finer.level.error_bound, coarser.level.occluder
    strays = deviation_from_solid(occluder, mesh, finer.solid)
    if strays + SLACK * finer.solid.filled.cell_size > bound:
        return None
    overhangs = measure_overhangs(mesh, [occluder, finer.level.occluder], finer.directions, device)
    own, others = (one.mean for one in overhangs)
    if own > max(others, finer.overhang) + MORE_RIGHTLY:
        return None
    promised = replace(occluder, error_bound=bound)
    level = replace(coarser.level, occluder=promised, deviation=strays)
    return replace(coarser, level=level, solid=finer.solid)
