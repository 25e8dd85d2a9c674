"""TriangleMesh -> LodChain: each level made by itself (paper section 4), the useless left out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from simplifier.errors import CancelledError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import LeftOut, LodChain, Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.geometry.solid import Solid
from simplifier.lods.choice import Kept, add_coarser, judge_level
from simplifier.lods.level_plan import LodPlan
from simplifier.options.stages import Options
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Cancel, Deadline, Listener, Progress, Stopwatch, check_run

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

    The rule is that of :mod:`simplifier.lods.choice`; a level's budget is never above the triangles
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
            level = judge_level(self.mesh, made, options)
            self.kept, left_out = add_coarser(self.kept, level, self.mesh)
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
