"""--memory-limit as users meet it: one line that says how much, what for, and what to do."""

from __future__ import annotations

import re

import pytest

import simplifier
from bench.stability.balls import write_ball
from tests.solids import sphere

LINE = (
    r"error: .*about [0-9.]+ GiB of memory would be needed, most of it to .*, and the limit is"
    r" 0\.\d+ GiB; .*a memory limit of at least [0-9.]+\n"
)


@pytest.fixture
def mesh(tmp_path):
    ball = sphere(rings=12)
    simplifier.save(simplifier.Occluder(ball.vertices, ball.faces), tmp_path / "ball.ply")
    return tmp_path / "ball.ply"


def test_simplify_refuses_a_grid_too_fine_and_writes_nothing(command, mesh, tmp_path):
    status, out, err = command(
        "simplify", mesh, "-o", tmp_path / "out.glb", "--resolution", "900", "--memory-limit", "0.4"
    )
    assert (status, out) == (1, "")
    assert re.fullmatch(LINE, err)
    assert re.search(r"choose a resolution of at most \d+, or", err)
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.parametrize(("limit", "refused"), [("8", False), ("0.4", True)])
def test_a_dry_run_tells_stage_by_stage_and_writes_nothing(command, mesh, tmp_path, limit, refused):
    status, out, err = command(
        "simplify", mesh, "-o", tmp_path / "out.glb", "--dry-run", "--resolution", "900",
        "--memory-limit", limit,
    )  # fmt: skip
    assert status == 0
    assert re.search(r"memory: refine .* \d+\.\d\d GiB", out)
    assert re.search(r"memory limit .* " + limit, out)
    assert ("would be refused" in err) == refused
    assert not (tmp_path / "out.glb").exists()


def test_evaluate_refuses(command, mesh):
    status, _, err = command("evaluate", mesh, mesh, "--resolution", "900", "--memory-limit", "0.4")
    assert status == 1
    assert re.fullmatch(LINE, err)


def test_scene_refuses_a_file_before_it_is_read(command, tmp_path):
    path = write_ball(tmp_path / "ball.stl", 4_000)
    status, _, err = command("scene", path, "-o", tmp_path / "out", "--memory-limit", "0.1")
    assert status == 1
    assert re.fullmatch(LINE, err)
    assert not (tmp_path / "out").exists()


def test_what_is_no_limit_is_wrong_usage(command, mesh, tmp_path):
    for limit in ("0", "-2", "nan"):
        status, _, err = command(
            "simplify", mesh, "-o", tmp_path / "out.glb", "--memory-limit", limit
        )
        assert status == 2
        assert "memory limit" in err
