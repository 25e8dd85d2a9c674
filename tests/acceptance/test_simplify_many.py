"""Several meshes in one call of the real ``occluder simplify``."""

from __future__ import annotations

import json
import os
import signal
import subprocess

import pytest

import simplifier
from tests import solids
from tests.acceptance.command import OCCLUDER, environment, occluder
from tests.schema import check_report
from tests.waiting import until

QUICK = ("--resolution", "12", "--moves", "40", "--views", "4", "--image", "32")
LONG = ("--resolution", "12", "--moves", "100000000", "--views", "4", "--image", "32")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Three meshes, one that is broken, and nothing known of earlier runs."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    (tmp_path / "more").mkdir()
    for name, mesh in (
        ("ball.ply", solids.sphere()), ("box.ply", solids.box()), ("more/ring.ply", solids.torus()),
    ):  # fmt: skip
        simplifier.save(solids.as_occluder(mesh), tmp_path / name)
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat")
    return tmp_path


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes()
            for path in folder.rglob("*") if path.is_file()}  # fmt: skip


@pytest.mark.usefixtures("making_here")
def test_each_mesh_gets_a_file_and_a_line(folder, here):
    """In the order of the call; the bytes are those of a call a mesh; a second run makes none."""
    names = ("box.ply", "bad.ply", "more/ring.ply", "ball.ply")
    done = occluder("simplify", *names, "-o", "out", *QUICK, cwd=folder)
    assert done.returncode == 1
    assert "error: bad.ply: " in done.stderr
    *lines, last = done.stdout.splitlines()
    assert [line.partition(": ")[0] for line in lines] == ["box.ply", "more/ring.ply", "ball.ply"]
    assert lines[0].startswith("box.ply: out/box_occluder.glb, ")
    assert last.startswith("4 meshes: 3 made, 1 failed; ")
    made = files(folder / "out")
    assert set(made) == {"box_occluder.glb", "ring_occluder.glb", "ball_occluder.glb"}
    alone = here("simplify", "more/ring.ply", "-o", "alone.glb", *QUICK, cwd=folder)
    assert alone.returncode == 0, alone.stderr
    assert (folder / "alone.glb").read_bytes() == made["ring_occluder.glb"]
    again = here("simplify", *names, "-o", "out", *QUICK, "--json", cwd=folder)
    assert again.returncode == 1
    rows = [json.loads(line) for line in again.stdout.splitlines()]
    assert [(row["mesh"], row["state"]) for row in rows] == [
        ("box.ply", "current"), ("bad.ply", "failed"), ("more/ring.ply", "current"),
        ("ball.ply", "current"),
    ]  # fmt: skip
    assert rows[1]["error"].startswith("bad.ply: ")
    assert rows[2]["output"] == "out/ring_occluder.glb"
    check_report(rows[2]["report"])
    assert files(folder / "out") == made


@pytest.mark.usefixtures("making_here")
def test_levels_go_beside_each_mesh_by_a_path_with_fields(folder, here):
    done = here("simplify", "box.ply", "more/ring.ply", "-o", "{folder}/{name}_low.obj",
                "--lods", "2", *QUICK, "--force", "--strict", cwd=folder)  # fmt: skip
    assert (folder / "more/ring_low_lod0.obj").exists(), done.stderr
    good = "; 2 good" in done.stdout
    assert done.returncode == (0 if good else 1)
    assert good != ("the occluder is not good" in done.stderr)
    assert not list(folder.glob("*.glb"))


WRONG = {
    "one file for two": (("box.ply", "more/box.ply", "-o", "out"), "is what both"),
    "a mesh replaced": (("box.ply", "ball.ply", "-o", "{folder}/{name}.ply"), "the mesh itself"),
    "an unknown field": (("box.ply", "-o", "{name}/{size}.glb"), "has no {size}"),
    "one report": (("box.ply", "ball.ply", "-o", "out", "--report", "r.json"), "--json"),
    "one set of overrides": (("box.ply", "-o", "out", "--overrides", "o.toml"), "beside each"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_usage_makes_nothing(folder, here, name):
    before = files(folder)
    arguments, words = WRONG[name]
    done = here("simplify", *arguments, cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert files(folder) == before


def test_an_unknown_format_makes_nothing(folder, here):
    done = here("simplify", "box.ply", "ball.ply", "-o", "{name}.fbx", cwd=folder)
    assert done.returncode == 1
    assert "cannot be written" in done.stderr


def test_an_interrupted_run_leaves_whole_files_alone(folder, here):
    """What is done is kept and current, the rest is made by the next run."""
    assert here("simplify", "box.ply", "-o", "out/", *LONG[:2], "--moves", "40",
                *LONG[4:], cwd=folder).returncode == 0  # fmt: skip
    before = files(folder / "out")
    scratch = folder / "scratch"
    scratch.mkdir()
    with subprocess.Popen(
        [*OCCLUDER, "simplify", "box.ply", "ball.ply", "more/ring.ply", "-o", "out/", *LONG],
        cwd=folder, env=environment(TMPDIR=str(scratch)), stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    ) as process:  # fmt: skip
        until(lambda: list(scratch.glob("occluder-*/0")))
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "error: interrupted; 0 of 3 meshes are done, run it again for the rest" in errors
    assert "Traceback" not in errors
    assert files(folder / "out") == before
    assert not list(scratch.iterdir())
