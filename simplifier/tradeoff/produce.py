"""``occluder tradeoff`` as one call: a mesh at many settings, each run timed and judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict

from simplifier.checks import check_callable, check_cancel, check_kind
from simplifier.errors import CancelledError
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.production.options import TradeoffOptions
from simplifier.progress import Cancel
from simplifier.tradeoff.study import Study, study_of
from simplifier.tradeoff.sweep import SweepOptions, mesh_trials

TellRun = Callable[[int, int, str], object]
"""Called with the number of runs that are done, of how many, and what is running now."""


def sweep_tradeoff(
    mesh: TriangleMesh,
    options: TradeoffOptions,
    *,
    name: str = "mesh",
    tell: TellRun = lambda done, runs, now: None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
) -> Study:
    """Measure what more time buys on a mesh, which tables and pages call ``name``.

    ``overrides`` hold for every run; the mesh was loaded with what they ignore.

    What ``tell`` raises ends the sweep.  ``cancel``, once set, ends it soon.  Raises
    :class:`~simplifier.errors.CancelledError` then, however much was measured.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("options", options, TradeoffOptions, "simplifier.TradeoffOptions")
    check_callable("tell", tell)
    check_cancel(cancel)
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    chosen = asdict(options)
    precision = chosen.pop("precision")
    sweep = SweepOptions(**chosen)
    runs = len(sweep.settings()) * sweep.repeats

    def told(done: int, now: str) -> object:
        return tell(done, runs, now)

    trials = list(mesh_trials(name, mesh, sweep, told, cancel, overrides))
    if cancel is not None and cancel.is_set():
        raise CancelledError(f"cancelled after {len(trials)} of {runs} runs")
    tell(runs, runs, "writing")
    return study_of(trials, sweep, precision)
