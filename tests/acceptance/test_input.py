"""Files that cannot be used, by the command line and by the service: told, and nothing left."""

from __future__ import annotations

import hashlib
import os

import httpx
import pytest

from simplifier.geometry.occluder import Occluder
from simplifier.io.save import save_occluder
from tests.acceptance.command import ROOT, occluder
from tests.extremes.inputs import CASES, Refused, Usable
from tests.service.declared import declare
from tests.service.real import QUICK, running
from tests.solids import box
from tests.waiting import BUSY

NAMES = (
    "nothing but NaN", "an index of 2**63 - 1", "obj in UTF-16", "obj with decimal commas",
    "other text under .obj", "an extension of positions", "an extension that cannot be printed",
    "draco", "a projection", "objects in objects", "a buffer beside that is not there",
)  # fmt: skip
"""One of each kind."""


def told(shown, path):
    """The one line of a refusal."""
    assert "Traceback" not in shown
    (line,) = shown.splitlines()
    assert line.startswith("error: ")
    assert str(path) in line
    assert "; " in line  # what to do
    return line


@pytest.mark.parametrize("subcommand", ["simplify", "evaluate", "scene"])
@pytest.mark.parametrize("name", NAMES)
def test_the_command_tells_in_one_line_and_leaves_nothing(command, tmp_path, name, subcommand):
    case = CASES[name]
    path, output = tmp_path / f"mesh{case.suffix}", tmp_path / "out"
    path.write_bytes(case.data)
    arguments = {
        "simplify": (path, "-o", output / "occluder.glb", "--report", output / "report.json"),
        "evaluate": (path, path, "--report", output / "report.json"),
        "scene": (path, "-o", tmp_path / "scene"),
    }[subcommand]
    output.mkdir()
    status, shown, errors = command(subcommand, *arguments)
    assert status == 1
    assert not shown
    told(errors, path)
    assert list(output.iterdir()) == []
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [path.name, "out"]


def test_a_process_of_its_own_ends_with_the_status(tmp_path):
    """In another locale, where standard error has no letters beyond ASCII."""
    path = tmp_path / "café\udcff.obj"
    path.write_bytes(b"\0" * 1000)
    done = occluder("simplify", path, "-o", tmp_path / "out.glb", LC_ALL="C", PYTHONUTF8="0")
    assert (done.returncode, done.stdout) == (1, "")
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
    assert "this is no text" in done.stderr
    assert list(tmp_path.iterdir()) == [path]


def test_far_away_triangles_are_warned_of(command, tmp_path):
    path, output = tmp_path / "mesh.obj", tmp_path / "occluder.glb"
    path.write_bytes(CASES["a corner at 1e30"].data)
    status, _, errors = command("simplify", path, "-o", output, "--preset", "draft")
    assert status == 0
    assert "1 unusable triangle of the input was left out" in errors
    assert "(the first is triangle 4); check the export" in errors


PLAIN = {"OCCLUDER_DASHBOARD": "false"}
"""Nobody looks at its pages, which take 0.3 s of processor time to load."""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    """A real one, which lives on after every file."""
    declared = os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])
    with running(declared, tmp_path_factory.mktemp("served") / "data", **PLAIN) as server:
        yield server
        assert "Traceback" not in server.log.read_text()
        assert server.process.poll() is None


def posted(server, case):
    query = {"filename": f"mesh{case.suffix}", **QUICK}
    return httpx.post(
        f"{server.address}/v1/occluders", params=query, content=case.data,
        headers={"Prefer": "wait=60"}, timeout=90.0,
    )  # fmt: skip


def test_the_service_answers_each_with_a_problem_and_works_on(server):
    """Of a refused mesh the upload is kept, for the job can be run again; nothing else is."""
    for name in NAMES:
        case = CASES[name]
        assert isinstance(case, Refused)
        answer = posted(server, case)
        assert answer.status_code == 400, (name, answer.text)
        assert answer.headers["content-type"] == "application/problem+json"
        problem = answer.json()
        assert problem["type"] == "/problems/unreadable-mesh"
        assert problem["remedy"]
        assert "mesh" in problem["detail"]
        assert str(server.log.parent) not in answer.text  # no path of the server
    kept = (server.log.with_suffix("") / "blobs").glob("??/*")
    uploads = [hashlib.sha256(CASES[name].data).hexdigest() for name in NAMES]
    assert sorted(path.parent.name + path.name for path in kept) == sorted(uploads)
    case = CASES["a corner at 1e30"]
    assert isinstance(case, Usable)
    answer = posted(server, case)
    assert answer.status_code == 200, answer.text
    assert any(
        "1 unusable triangle" in line for line in answer.json()["job"]["summary"]["warnings"]
    )
    assert httpx.get(f"{server.address}/healthz", timeout=BUSY).status_code == 200


LONG = "n" * 300
NAMED = {
    "a mesh": ("simplify", f"{LONG}.ply", "-o", "out.glb"),
    "an occluder": ("simplify", "mesh.ply", "-o", f"{LONG}.glb"),
    "a report": ("simplify", "mesh.ply", "-o", "out.glb", "--report", f"{LONG}.json"),
    "a mesh to judge": ("evaluate", f"{LONG}.ply", "mesh.ply"),
    "pictures": ("evaluate", "mesh.ply", "mesh.ply", "--pictures", LONG),
    "a scene": ("scene", f"{LONG}.glb", "-o", "scene"),
    "a folder": ("scene", "mesh.ply", "-o", LONG),
    "occluders": ("cull", "mesh.ply", "--occluders", LONG, "--path", "walk.json", "-o", "cull"),
    "a path": ("path", "mesh.ply", "-o", f"{LONG}.json"),
    "cells": ("pvs", "mesh.ply", "-o", "out.pvs", "--cells", LONG),
    "sets": ("pvs", "mesh.ply", "-o", f"{LONG}.pvs"),
    "a manifest": ("build", f"{LONG}.toml"),
}


@pytest.mark.parametrize("arguments", NAMED.values(), ids=NAMED)
@pytest.mark.parametrize("circle", [False, True], ids=["a name too long", "links in a circle"])
def test_a_name_that_the_system_refuses_is_told_in_one_line(
    command, tmp_path, monkeypatch, arguments, circle
):
    """Some were unexpected errors, one a traceback."""
    mesh = box((1.0, 2.0, 3.0))
    save_occluder(Occluder(mesh.vertices, mesh.faces), tmp_path / "mesh.ply")
    (tmp_path / "loop").symlink_to("loop")
    if circle:
        arguments = [one.replace(LONG, "loop/name") for one in arguments]
    monkeypatch.chdir(tmp_path)
    status, shown, errors = command(*arguments)
    assert status in (1, 2)
    assert not shown
    (line,) = errors.splitlines()
    assert line.startswith("error: ")
    assert "unexpected" not in line
    assert "; " in line
    assert {entry.name for entry in tmp_path.iterdir()} <= {"mesh.ply", "loop", "scene", "cull"}


def test_a_mesh_whose_overrides_would_have_too_long_a_name_is_read(command, tmp_path, monkeypatch):
    mesh = box((1.0, 2.0, 3.0))
    name = f"{'n' * 251}.ply"
    save_occluder(Occluder(mesh.vertices, mesh.faces), tmp_path / name)
    monkeypatch.chdir(tmp_path)
    quick = [f"--{option}={value}" for option, value in QUICK.items() if option != "lods"]
    status, _, errors = command("simplify", name, "-o", "out.glb", *quick)
    assert status == 0, errors
    assert (tmp_path / "out.glb").is_file()
