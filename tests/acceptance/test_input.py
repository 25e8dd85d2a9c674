"""Files that cannot be used, by the command line and by the service: told, and nothing left."""

from __future__ import annotations

import hashlib
import os

import httpx
import pytest

from tests.acceptance.command import ROOT, occluder
from tests.extremes.inputs import CASES, Refused, Usable
from tests.service.declared import declare
from tests.service.real import QUICK, running
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
