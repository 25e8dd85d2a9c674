"""What a mesh's occluder costs and is worth at many settings.

A setting is run several times, in rounds over all settings, so that a machine that gets busy or
warm slows all of them alike; its time is the median of its runs, from the mesh in memory to the
triangles.  Reading and judging are left out.  Accuracy is exact: all quads of 256 views.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.overhang import measure_overhang
from simplifier.device.device import PROCESSOR
from simplifier.device.remembering import remembering, rest
from simplifier.errors import CancelledError, OccluderError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.overrides import NO_OVERRIDES, Overrides
from simplifier.io.load import load
from simplifier.memory.runs import Judging, check_making
from simplifier.options.simplify import Axis, Preset
from simplifier.options.stages import Options, make_options
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.pipeline import simplify_mesh
from simplifier.progress import Cancel, Deadline, TellStep

DEFAULT: Preset = "balanced"
"""The preset that the other settings depart from."""

PRESET_POINTS: tuple[Preset, ...] = ("draft", "balanced", "best")

Knob = Literal["preset", "resolution", "directions", "time"]
KNOBS: tuple[Knob, ...] = ("preset", "resolution", "directions", "time")


@dataclass(frozen=True)
class Setting:
    """A budget, a preset, and what departs from it; None is as the preset has it.

    ``time``  limit of a run, seconds: less shortens the preset's work, more goes on refining.
    """

    budget: int
    preset: Preset = DEFAULT
    resolution: int | None = None
    directions: int | None = None
    time: float | None = None

    @property
    def departures(self) -> dict[Knob, str]:
        """What departs from the default, in the words that users read."""
        named: dict[Knob, str] = {}
        if self.preset != DEFAULT:
            named["preset"] = self.preset
        if self.resolution is not None:
            named["resolution"] = f"resolution {self.resolution}"
        if self.directions is not None:
            named["directions"] = f"{self.directions} directions"
        if self.time is not None:
            named["time"] = f"time {self.time:g} s"
        return named

    @property
    def name(self) -> str:
        """Tells a setting from all others of its budget."""
        return " + ".join(self.departures.values()) or self.preset

    @property
    def knob(self) -> Knob | None:
        """The one knob that is turned, None where several are; the default is a preset."""
        turned = list(self.departures)
        if len(turned) > 1:
            return None
        return turned[0] if turned else "preset"

    def options(self, longest_edge: float, up: Axis, ground: bool, seed: int) -> Options:
        """All of it.  Raises :class:`OptionError` for a value out of range."""
        made = make_options(
            longest_edge, budget=self.budget, resolution=self.resolution, up=up, ground=ground,
            preset=self.preset, seed=seed,
            time_limit=self.time,
        )  # fmt: skip
        if self.directions is None:
            return made
        return replace(made, sections=replace(made.sections, directions=self.directions))


def settings_of(options: TradeoffOptions) -> list[Setting]:
    """Every setting once, by budget, the presets first; those that say the same are one."""
    named: dict[Options, Setting] = {}
    for budget in options.budgets:
        for setting in _settings_of_budget(options, Setting(budget)):
            named.setdefault(setting_options(options, setting, 1.0), setting)
    return list(named.values())


def setting_options(options: TradeoffOptions, setting: Setting, longest_edge: float) -> Options:
    """The options of a setting's runs on a mesh of that size, world units."""
    return setting.options(longest_edge, options.up, options.ground, options.seed)


def _settings_of_budget(options: TradeoffOptions, default: Setting) -> Iterator[Setting]:
    yield from (replace(default, preset=preset) for preset in PRESET_POINTS)
    yield from (replace(default, resolution=value) for value in options.resolutions)
    yield from (replace(default, directions=value) for value in options.directions)
    yield from (replace(default, time=value) for value in options.times)
    if options.full:
        for values in product(options.resolutions, options.directions, options.times):
            yield Setting(default.budget, DEFAULT, *values)


@dataclass(frozen=True)
class Trial:
    """One run of one setting; ``failure`` says why there is no result, else it is empty.

    ``mesh``  its name; ``setting`` None where the mesh itself could not be read.
    ``seconds``  from the mesh in memory to the triangles; ``triangles`` of the occluder;
    ``overhang`` in the mean over all views.
    """

    mesh: str
    setting: Setting | None
    seconds: float = math.nan
    triangles: int = 0
    precision: float = math.nan
    recall: float = math.nan
    warnings: tuple[str, ...] = ()
    failure: str = ""
    overhang: float = math.nan


@dataclass(frozen=True)
class Outcome:
    """A setting's median run, with the spread of its times."""

    trial: Trial
    seconds_min: float
    seconds_max: float
    repeats: int


class Keeper(Protocol):
    """Keeps trials as they come, and knows those of a sweep that did not end."""

    def known(self, mesh: TriangleMesh, number: int, setting: Setting, name: str) -> Trial | None:
        """The trial of a setting in a round, if it was run before."""

    def keep(self, mesh: TriangleMesh, number: int, trial: Trial) -> None:
        """Keep a trial of a round."""


OverridesOf = Callable[[Path], Overrides]
"""Those of a mesh's file; raises :class:`~simplifier.errors.OverridesError`."""


def sweep(
    paths: Sequence[Path],
    options: TradeoffOptions,
    tell: TellStep = lambda done, name: None,
    overrides_of: OverridesOf = lambda path: NO_OVERRIDES,
    keeper: Keeper | None = None,
) -> Iterator[Trial]:
    """Run every setting on every mesh, as results come; what fails is a result too.

    Of the time that ``options.within`` leaves, each mesh has an equal part.
    """
    before = 0
    whole, names = Deadline.after(options.within), mesh_names(paths)
    for number, (name, path) in enumerate(names.items()):
        told, deadline = _tell_from(before, tell), whole.part(1.0 / (len(names) - number))
        yield from _mesh_trials(name, path, options, told, overrides_of, keeper, deadline)
        before += len(settings_of(options)) * options.repeats
    tell(before, "writing")


def _tell_from(before: int, tell: TellStep) -> TellStep:
    return lambda done, name: tell(before + done, name)


def run_count(paths: Sequence[Path], options: TradeoffOptions) -> int:
    """How many runs a sweep has."""
    return len(mesh_names(paths)) * len(settings_of(options)) * options.repeats


def mesh_names(paths: Sequence[Path]) -> dict[str, Path]:
    """Each file once, by its name, or as it was given where two have the same name."""
    files = list(dict.fromkeys(paths))
    names = [path.name for path in files]
    return {path.name if names.count(path.name) == 1 else str(path): path for path in files}


def outcomes(trials: Sequence[Trial]) -> list[Outcome]:
    """One for each setting of each mesh, in the order in which they first ran.

    The lower of two middle runs is the median, so that time and accuracy are of the same run.  A
    setting that failed in one run has failed.
    """
    groups: dict[tuple[str, Setting | None], list[Trial]] = {}
    for trial in trials:
        groups.setdefault((trial.mesh, trial.setting), []).append(trial)
    return [_outcome(group) for group in groups.values()]


def _outcome(runs: list[Trial]) -> Outcome:
    failed = [run for run in runs if run.failure]
    if failed:
        return Outcome(failed[0], math.nan, math.nan, len(runs))
    ranked = sorted(runs, key=lambda run: run.seconds)
    middle = ranked[(len(ranked) - 1) // 2]
    return Outcome(middle, ranked[0].seconds, ranked[-1].seconds, len(runs))


def _mesh_trials(
    name: str, path: Path, options: TradeoffOptions, tell: TellStep, overrides_of: OverridesOf,
    keeper: Keeper | None, deadline: Deadline,
) -> Iterator[Trial]:  # fmt: skip
    tell(0, name)
    try:
        overrides = overrides_of(path)
        mesh = load(
            path,
            transparent=options.transparent,
            ignore=overrides.ignore,
            memory_limit=options.memory_limit,
        )
    except Exception as error:
        yield Trial(name, None, failure=_reason(error))
        return
    if overrides != NO_OVERRIDES:
        keeper = None  # it tells meshes apart, not what was drawn by hand
    yield from mesh_trials(name, mesh, options, deadline, tell, overrides=overrides, keeper=keeper)


def mesh_trials(
    name: str,
    mesh: TriangleMesh,
    options: TradeoffOptions,
    deadline: Deadline,
    tell: TellStep = lambda done, name: None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
    keeper: Keeper | None = None,
) -> Iterator[Trial]:
    """Run every setting on one mesh, which was loaded with what ``overrides`` ignore, as results
    come.

    Ends soon once ``cancel`` is set or ``deadline`` is up; the run that it ends is no trial.  The
    first run is made in any case.  What ``keeper`` knows is not run again.
    """
    run = _Run(name, mesh, overrides, options, _Judge(mesh, options.seed))
    failed: set[Setting] = set()
    done = 0
    for number, setting in product(range(options.repeats), settings_of(options)):
        if done and deadline.is_up:
            return
        tell(done, f"{name}, {setting.budget} triangles, {setting.name}")
        done += 1
        if setting in failed:
            continue
        trial = keeper.known(mesh, number, setting, name) if keeper is not None else None
        if trial is None:
            try:
                trial = run.trial(setting, _Ends(cancel, deadline) if done > 1 else cancel)
            except CancelledError:
                return
            if keeper is not None:
                keeper.keep(mesh, number, trial)
        if trial.failure:
            failed.add(setting)
        yield trial


@dataclass(frozen=True, eq=False)
class _Ends:
    """A cancel that is set by another, or by the end of the time."""

    cancel: Cancel | None
    deadline: Deadline

    def is_set(self) -> bool:
        return self.deadline.is_up or (self.cancel is not None and self.cancel.is_set())


@dataclass(frozen=True, eq=False)
class _Run:
    """What all settings of a mesh have in common."""

    name: str
    mesh: TriangleMesh
    overrides: Overrides
    options: TradeoffOptions
    judge: _Judge

    def trial(self, setting: Setting, cancel: Cancel | None) -> Trial:
        mesh = self.mesh
        try:
            resolved = setting_options(self.options, setting, float(mesh.extent.max()))
            check_making(mesh, resolved, self.options.memory_limit, Judging(again=True))
            begin = time.perf_counter()
            result = simplify_mesh(mesh, resolved, cancel=cancel, overrides=self.overrides)
            seconds = time.perf_counter() - begin
            if result.interrupted:
                raise CancelledError("cancelled while a setting ran")
            shares = self.judge.shares(result.occluder)
        except CancelledError:
            raise
        except Exception as error:
            return Trial(self.name, setting, failure=_reason(error))
        count = len(result.occluder.faces)
        return Trial(
            self.name, setting, seconds, count, shares.precision, shares.recall, result.warnings,
            overhang=shares.overhang,
        )  # fmt: skip


def _reason(error: Exception) -> str:
    """One bad mesh must not end a sweep of hours, so a bug is a reason too."""
    if isinstance(error, OccluderError):
        return str(error)
    if isinstance(error, MemoryError):
        return "out of memory; choose a lower resolution"
    return f"unexpected {type(error).__name__}: {error}"


class _Shares(NamedTuple):
    precision: float
    recall: float
    overhang: float


class _Judge:
    """Exact accuracy and overhang; equal occluders, as repeats mostly give, are judged once."""

    def __init__(self, mesh: TriangleMesh, seed: int) -> None:
        self._mesh = mesh
        self._options = AccuracyOptions(seed=seed, exact=True)
        self._device = remembering(PROCESSOR)
        self._known: dict[tuple[bytes, bytes], _Shares] = {}

    def shares(self, occluder: Occluder) -> _Shares:
        key = (occluder.vertices.tobytes(), occluder.faces.tobytes())
        if key not in self._known:
            mesh, device = self._mesh, self._device
            report = evaluate_accuracy(mesh, occluder, self._options, device=device)
            overhang = measure_overhang(mesh, occluder, report.directions, device).mean
            rest(device)
            self._known[key] = _Shares(report.precision, report.recall, overhang)
        return self._known[key]
