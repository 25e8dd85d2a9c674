"""Foretold memory beside the true peak of a process, and runs that are refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import simplifier
from bench.stability.balls import write_ball
from simplifier import EvaluateOptions, MemoryLimitError, OptionError, SimplifyOptions
from simplifier.production.estimate import check_file, estimate_memory
from simplifier.tradeoff import sweep as tradeoff
from tests.acceptance.command import ROOT, environment
from tests.solids import sphere

BALL = sphere(rings=16)
FACTOR = 1.5

PEAK = """
import sys
from pathlib import Path
import simplifier
mesh = simplifier.load(sys.argv[1])
product = simplifier.simplify(mesh, simplifier.SimplifyOptions.of(eval(sys.argv[2]))).measure()
product.report()
lines = Path("/proc/self/status").read_text().splitlines()
print(next(line.split()[1] for line in lines if line.startswith("VmHWM")))
"""


@pytest.mark.sweep(2)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads a peak that Linux tells")
@pytest.mark.parametrize(
    ("triangles", "chosen"),
    [(400_000, {"resolution": 16}), (2_000, {"resolution": 200, "smallest_hole": 0.1})],
)
def test_the_true_peak_is_within_the_factor(tmp_path, triangles, chosen):
    path = write_ball(tmp_path / "ball.stl", triangles)
    options = {"preset": "draft", "moves": 60, "views": 4, "image": 64, **chosen}
    command = [sys.executable, "-c", PEAK, str(path), repr(options)]
    done = subprocess.run(
        command, cwd=ROOT, env=environment(), capture_output=True, text=True, check=True
    )
    peak = int(done.stdout) / 1024 / 1024
    asked = SimplifyOptions.of(options)
    need = estimate_memory(path, asked).joined(estimate_memory(simplifier.load(path), asked))
    assert peak / FACTOR < need.gib < peak * FACTOR


def test_a_file_is_known_to_need_no_more_than_its_mesh(tmp_path):
    path = write_ball(tmp_path / "ball.ply", 10_000)
    for options in (
        None, SimplifyOptions(resolution=200, shrink=0.1), SimplifyOptions(error_bound=0.05),
        SimplifyOptions(lods=3), SimplifyOptions(error_bounds=(0.05, 0.1)), EvaluateOptions(),
    ):  # fmt: skip
        whole = estimate_memory(simplifier.load(path), options)
        known = estimate_memory(path, options)
        assert all(known.stages[name] <= need for name, need in whole.stages.items())
        assert "load" in known.stages


def test_pictures_and_a_copy_to_look_at_are_stages_of_their_own():
    need = estimate_memory(BALL, pictures=True, viewing=True)
    assert {"pictures", "viewing"} <= set(need.stages)
    assert not {"pictures", "viewing"} & set(estimate_memory(BALL).stages)


def test_a_run_too_large_is_refused_by_every_call(tmp_path):
    occluder = simplifier.Occluder(BALL.vertices, BALL.faces)
    limit = 0.2
    calls = (
        lambda: simplifier.simplify(BALL, resolution=512, memory_limit=limit).occluder,
        lambda: simplifier.simplify(BALL, resolution=512, memory_limit=limit, lods=3).chain,
        lambda: simplifier.simplify(
            BALL, SimplifyOptions(resolution=512, memory_limit=limit)
        ).measure(),
        lambda: simplifier.evaluate(
            BALL, occluder, EvaluateOptions(resolution=512, memory_limit=limit)
        ),
        lambda: (
            simplifier.evaluate(
                BALL, occluder, views=60_000, image=4096, memory_limit=limit
            ).accuracy
        ),
    )
    for call in calls:
        with pytest.raises(MemoryLimitError, match="of memory would be needed, most of it to "):
            call()


def test_the_resolution_that_the_message_names_can_be_run():
    with pytest.raises(MemoryLimitError) as told:
        simplifier.simplify(BALL, SimplifyOptions(resolution=1024, memory_limit=0.3)).measure()
    assert 32 < told.value.resolution < 1024
    fitting = SimplifyOptions(resolution=told.value.resolution, memory_limit=0.3)
    assert estimate_memory(BALL, fitting).gib <= 0.3


def test_a_file_is_refused_by_what_only_later_stages_need(tmp_path):
    path = write_ball(tmp_path / "ball.ply", 10_000)
    options = SimplifyOptions(budget=100_000, preset="best", memory_limit=0.5)
    check_file(path, SimplifyOptions(memory_limit=0.5))
    with pytest.raises(MemoryLimitError, match=r"ball\.ply: .* most of it to refine"):
        check_file(path, options)


def test_limits_are_checked_as_options():
    for options in (SimplifyOptions, EvaluateOptions, simplifier.TradeoffOptions):
        with pytest.raises(OptionError, match=r"^memory limit: "):
            options(memory_limit=0.0)
    with pytest.raises(OptionError, match=r"^memory limit: "):
        simplifier.simplify(BALL, memory_limit=-1.0)


@pytest.mark.slow
def test_a_setting_of_a_sweep_that_needs_too_much_fails_alone(monkeypatch):
    monkeypatch.setattr(tradeoff, "PRESET_POINTS", ("draft",))
    options = simplifier.TradeoffOptions(
        resolutions=(1024,), directions=(16,), budgets=(8,), times=(0.05,), repeats=1,
        memory_limit=0.5,
    )  # fmt: skip
    rows = simplifier.sweep_tradeoff(BALL, options).rows
    failed = [row for row in rows if row["standing"] == "failed"]
    assert len(failed) == 1 < len(rows)
    assert "of memory would be needed" in failed[0]["reason"]


def test_a_scene_counts_the_occluders_that_are_made_at_once(tmp_path, monkeypatch):
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    (tmp_path / "meshes").mkdir()
    for name in ("one", "two"):
        write_ball(tmp_path / "meshes" / f"{name}.ply", 2000 if name == "one" else 4000)
    scene = simplifier.load_scene(tmp_path / "meshes")
    with pytest.raises(MemoryLimitError, match="to make several occluders at once") as told:
        simplifier.simplify_scene(scene, tmp_path / "out", resolution=400, memory_limit=0.8)
    assert 8 < told.value.resolution < 400
    assert not list((tmp_path / "out").glob("scene.json"))


@pytest.mark.parametrize("name", ["mesh.txt", "mesh"])
def test_a_file_of_no_format_cannot_be_foretold(tmp_path, name):
    with pytest.raises(simplifier.UnknownFormatError):
        estimate_memory(Path(tmp_path / name))
