"""Settings, their sweep, and what becomes of failures."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import simplifier
from simplifier.accuracy.accuracy import AccuracyOptions, evaluate_accuracy
from simplifier.accuracy.overhang import measure_overhang
from simplifier.device import remembering
from simplifier.errors import OptionError
from simplifier.geometry.occluder import Occluder
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.progress import Deadline
from simplifier.tradeoff import sweep as tradeoff
from simplifier.tradeoff.study import study_of
from simplifier.tradeoff.sweep import (
    Outcome,
    Setting,
    Trial,
    mesh_names,
    outcomes,
    run_count,
    settings_of,
    sweep,
)
from tests.solids import CORNERS, box, sphere, torus
from tests.tradeoff.sweeps import SMALL, trial


@pytest.fixture
def mesh_file(tmp_path):
    solid = box()
    simplifier.save(simplifier.Occluder(solid.vertices, solid.faces), tmp_path / "box.ply")
    return tmp_path / "box.ply"


@pytest.fixture
def quick(monkeypatch):
    """Every occluder is a square across the box, except where the tests break it."""
    square = Occluder(CORNERS[[0, 1, 7, 6]], np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))

    def simplify(mesh, options, cancel=None, overrides=None):
        return SimpleNamespace(occluder=square, warnings=("mind the gap",), interrupted=False)

    monkeypatch.setattr(tradeoff, "simplify_mesh", simplify)


@pytest.fixture
def steps(monkeypatch):
    """A clock that shows the given seconds for each run in turn."""

    def set_to(seconds):
        ticks = iter([tick for time in seconds for tick in (0.0, time)])
        clock = SimpleNamespace(perf_counter=lambda: next(ticks))
        monkeypatch.setattr(tradeoff, "time", clock)

    return set_to


@pytest.mark.parametrize(
    ("setting", "name", "knob"),
    [
        (Setting(64), "balanced", "preset"),
        (Setting(64, "draft"), "draft", "preset"),
        (Setting(64, resolution=32), "resolution 32", "resolution"),
        (Setting(64, directions=128), "128 directions", "directions"),
        (Setting(64, time=0.25), "time 0.25 s", "time"),
        (Setting(64, "balanced", 32, 16, 2.0), "resolution 32 + 16 directions + time 2 s", None),
    ],
)
def test_names(setting, name, knob):
    assert (setting.name, setting.knob) == (name, knob)


def test_a_setting_reaches_the_options():
    options = Setting(20, "balanced", 32, 16, 2.0).options(3.0, "z", True, 7)
    assert (options.selection.budget, options.solid.resolution) == (20, 32)
    assert (options.sections.directions, options.sections.depths) == (16, 4)
    assert (options.solid.up, options.solid.ground, options.seed) == ("z", True, 7)
    less = Setting(20, time=1.0).options(3.0, "z", True, 7)
    assert options != less
    assert Setting(20).options(1.0, "y", False, 0).sections.directions == 32


def test_one_knob_at_a_time():
    names = [setting.name for setting in settings_of(SMALL)]
    assert names == [
        "draft", "balanced", "best", "resolution 32", "resolution 128", "16 directions",
        "time 1 s", "time 2 s",
    ]  # fmt: skip


def test_every_budget_gets_every_setting():
    options = TradeoffOptions(budgets=(16, 64))
    by_budget = {16: [], 64: []}
    for setting in settings_of(options):
        by_budget[setting.budget].append(setting.name)
    assert by_budget[16] == by_budget[64]
    assert run_count([Path("a"), Path("b")], options) == 2 * 3 * len(settings_of(options))


def test_values_that_are_the_default_are_not_run_twice():
    options = TradeoffOptions(resolutions=(64,), directions=(32,), budgets=(9,), times=(1.0,))
    names = [setting.name for setting in settings_of(options)]
    assert names == ["draft", "balanced", "best", "time 1 s"]


def test_full_has_every_combination_and_all_single_ones():
    full = TradeoffOptions(
        resolutions=(32, 64), directions=(16, 32), budgets=(9,), times=(1.0, 2.0), full=True
    )
    settings = settings_of(full)
    assert len(settings) == len({setting.name for setting in settings})
    # Of the 8 combinations two are with the default's resolution and directions: time alone.
    assert sum(setting.knob is None for setting in settings) == 6
    single = TradeoffOptions(
        resolutions=(32, 64), directions=(16, 32), budgets=(9,), times=(1.0, 2.0)
    )
    assert set(settings_of(single)) < set(settings)


@pytest.mark.parametrize(
    "wrong",
    [
        {"resolutions": ()}, {"directions": ()}, {"budgets": ()}, {"times": ()},
        {"resolutions": (0,)}, {"resolutions": (1025,)}, {"directions": (0,)}, {"budgets": (0,)},
        {"times": (0.0,)}, {"times": (-1.0,)}, {"times": (math.nan,)}, {"times": (math.inf,)},
        {"repeats": 0}, {"seed": -1}, {"up": "w"},
    ],
)  # fmt: skip
def test_wrong_options(wrong):
    with pytest.raises(OptionError):
        TradeoffOptions(**wrong)


def test_names_of_meshes():
    one, other, third = Path("p/a.obj"), Path("q/a.obj"), Path("p/b.obj")
    assert mesh_names([one, third, one]) == {"a.obj": one, "b.obj": third}
    assert mesh_names([one, other, third]) == {"p/a.obj": one, "q/a.obj": other, "b.obj": third}


def test_the_median_run_is_one_of_them():
    setting = Setting(16)
    runs = [trial(setting, seconds, seconds / 10.0) for seconds in (4.0, 1.0, 3.0, 2.0)]
    assert outcomes(runs) == [Outcome(runs[3], 1.0, 4.0, 4)]
    assert outcomes(runs[:3]) == [Outcome(runs[2], 1.0, 4.0, 3)]


def test_a_setting_that_failed_once_has_failed():
    runs = [trial(Setting(16), 1.0, 0.5), Trial("a.obj", Setting(16), failure="out of memory")]
    (outcome,) = outcomes(runs)
    assert outcome.trial.failure == "out of memory"


def test_a_mesh_is_drawn_once_for_all_runs(monkeypatch):
    mesh, few = torus(), sphere(rings=4)
    larger = Occluder(1.5 * few.vertices, few.faces)  # reaches out of the mesh's sphere
    occluders = [Occluder(few.vertices * size, few.faces) for size in (0.2, 0.4, 0.3)]
    drawn, draw = Counter(), remembering.coverage_masks

    def counted(vertices, faces, projections, rows, *others):
        drawn[len(faces), rows] += 1
        return draw(vertices, faces, projections, rows, *others)

    monkeypatch.setattr(remembering, "coverage_masks", counted)
    judge = tradeoff._Judge(mesh, 7)
    shares = [judge.shares(one) for one in [*occluders, occluders[0], larger]]
    size = len(mesh.faces)
    assert (drawn[size, 256], drawn[size, 514]) == (1, 1)
    for one, told in zip([*occluders, occluders[0], larger], shares, strict=True):
        report = evaluate_accuracy(mesh, one, AccuracyOptions(seed=7, exact=True))
        overhang = measure_overhang(mesh, one, report.directions).mean
        assert told == (report.precision, report.recall, overhang)


def test_a_sweep_runs_in_rounds_and_tells_where_it_is(mesh_file, quick, steps):
    options = TradeoffOptions(
        resolutions=(8,), directions=(16,), budgets=(8,), times=(0.01,), repeats=2
    )
    names = [setting.name for setting in settings_of(options)]
    steps([float(i) for i in range(2 * len(names))])
    told = []
    trials = list(sweep([mesh_file], options, lambda done, name: told.append((done, name))))
    assert [t.setting.name for t in trials] == names * 2
    assert [t.seconds for t in trials] == [float(i) for i in range(2 * len(names))]
    assert {(t.triangles, t.failure, t.warnings) for t in trials} == {(2, "", ("mind the gap",))}
    assert all(0.0 < t.recall < 1.0 and t.precision > 0.99 for t in trials)
    assert [done for done, _ in told] == [0, *range(2 * len(names)), 2 * len(names)]
    assert told[3] == (2, f"box.ply, 8 triangles, {names[2]}")


def test_what_fails_is_told_and_the_others_go_on(mesh_file, tmp_path, quick, monkeypatch):
    def broken(mesh, options, cancel=None, overrides=None):
        if (options.sections.directions, options.sections.depths) == (16, 4):
            raise MemoryError
        if options.solid.resolution == 8:
            raise ZeroDivisionError("a bug")
        return whole(mesh, options)

    whole = tradeoff.simplify_mesh
    monkeypatch.setattr(tradeoff, "simplify_mesh", broken)
    options = TradeoffOptions(
        resolutions=(8,), directions=(16,), budgets=(8,), times=(0.01,), repeats=2
    )
    trials = list(sweep([tmp_path / "none.ply", mesh_file], options))
    assert trials[0].mesh == "none.ply"
    assert trials[0].setting is None
    assert "no such file" in trials[0].failure
    failed = {t.setting.name: t.failure for t in trials[1:] if t.failure}
    assert failed == {
        "16 directions": "out of memory; choose a lower resolution",
        "resolution 8": "unexpected ZeroDivisionError: a bug",
    }
    assert sum(bool(t.failure) for t in trials[1:]) == 2  # not tried again
    assert sum(not t.failure for t in trials) == 2 * 4


def test_ctrl_c_is_not_a_failure_of_the_mesh(mesh_file, monkeypatch):
    def interrupted(*_, cancel=None, overrides=None):
        raise KeyboardInterrupt

    monkeypatch.setattr(tradeoff, "simplify_mesh", interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(sweep([mesh_file], SMALL))


def test_a_sweep_ends_within_its_time(mesh_file, quick, monkeypatch):
    options = replace(SMALL, repeats=50, within=1e-3)
    trials = list(sweep([mesh_file], options))
    assert [one.setting for one in trials] == settings_of(options)[:1]  # the first in any case
    assert not trials[0].failure
    left = len(settings_of(options)) - 1
    told = f"{mesh_file.name}: there was no time for {left} of {left + 1} settings; allow more than"
    assert any(line.startswith(told) for line in study_of(trials, options, 0.9).warnings)
    whole = list(sweep([mesh_file], SMALL))
    assert not any("no time" in line for line in study_of(whole, SMALL, 0.9).warnings)


def test_each_mesh_has_an_equal_part_of_the_time(mesh_file, quick, monkeypatch):
    """Each run takes a second.  A mesh that cannot be read leaves its part to the others."""
    now, quick_run = [0.0], tradeoff.simplify_mesh

    def timed(*given, **named):
        now[0] += 1.0
        return quick_run(*given, **named)

    monkeypatch.setattr(tradeoff, "simplify_mesh", timed)
    clock = SimpleNamespace(after=lambda seconds: Deadline.after(seconds, lambda: now[0]))
    monkeypatch.setattr(tradeoff, "Deadline", clock)
    files = [mesh_file.with_name(f"{name}.ply") for name in ("damaged", "one", "other")]
    for file in files[1:]:
        file.write_bytes(mesh_file.read_bytes())
    trials = list(sweep(files, replace(SMALL, repeats=50, within=12.0)))
    assert Counter(one.mesh for one in trials) == {"damaged.ply": 1, "one.ply": 6, "other.ply": 6}
