"""Failures in one line, also those that the program has no class for."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
import typer

import simplifier
from simplifier.cli.running import run_guarded
from tests.acceptance.command import OCCLUDER, environment
from tests.solids import box


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no disk that is full")
def test_a_full_disk_behind_standard_output_is_told_as_that(tmp_path):
    mesh = box()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), tmp_path / "box.ply")
    words = ["simplify", "box.ply", "-o", "out.glb", "--preset", "draft", "--resolution", "8"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*OCCLUDER, *words], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
            env=environment(),
        )  # fmt: skip
    assert done.returncode == 1
    assert "error: standard output cannot be written" in done.stderr
    assert "unexpected" not in done.stderr
    assert (tmp_path / "out.glb").stat().st_size > 0


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (OSError(28, "No space left on device"), "error: standard output cannot be written"),
        (OSError(28, "No space left on device", "a.glb"), "error: unexpected OSError: "),
        (OSError(5, "Input/output error"), "error: unexpected OSError: "),
        (RuntimeError("can't start new thread"), "error: no thread can be started: "),
        (RuntimeError("something else"), "error: unexpected RuntimeError: something else; "),
    ],
)
def test_what_is_told_of_other_errors(capfd, error, told):
    def fail():
        raise error

    with pytest.raises(typer.Exit) as ended:
        run_guarded(fail, debug=False)
    assert ended.value.exit_code == 1
    _, errors = capfd.readouterr()
    assert errors.startswith(told)
    assert errors.count("\n") == 1


def test_a_status_that_was_told_is_passed_on(capfd):
    def leave():
        raise typer.Exit(3)

    with pytest.raises(typer.Exit) as ended:
        run_guarded(leave, debug=False)
    assert ended.value.exit_code == 3
    assert capfd.readouterr() == ("", "")
