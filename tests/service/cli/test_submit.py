"""``occluder submit`` against a server that answers as told."""

from __future__ import annotations

import hashlib
import itertools
import json
import signal
import subprocess
import threading

import pytest

from service.schemas.job_options import LEVELS
from tests.acceptance.command import OCCLUDER, environment
from tests.service.client.scripted import (
    Reply,
    events,
    form_of,
    job,
    problem,
    serving,
    summary,
)


class Service:
    """Jobs that succeed, one a mesh, unless their mesh says otherwise."""

    def __init__(self):
        self.seen = []
        self.names = {}
        self.cancelled = threading.Event()
        self.waited_for = threading.Event()
        self._numbers = itertools.count(1)
        self._lock = threading.Lock()

    def answer(self, request):
        with self._lock:
            self.seen.append(request)
        parts = request.path.strip("/").split("/")
        if request.method == "POST" and parts == ["v1", "occluders"]:
            return self._begin(request)
        told = self.job(parts[2])
        match parts[3:]:
            case ["events"]:
                self.waited_for.set()
                if told["name"] == "endless.obj":
                    assert self.cancelled.wait(20)
                    told = {**told, "state": "cancelled"}
                step = {"stage": "refine", "fraction": 0.5, "measure": 0.4}
                return events(
                    ("state", {**told, "state": "running"}), ("progress", step), ("state", told)
                )
            case ["cancel"]:
                self.cancelled.set()
                return Reply({**told, "state": "running"})
            case ["result"]:
                levels = [{"level": level, "triangles": 8, "files": {}} for level in range(2)]
                return Reply({"job": told, "report": {}, "levels": levels, "files": []})
            case ["files", name]:
                data = f"{told['name']} {name}".encode()
                return Reply(data, headers={"ETag": f'"{hashlib.sha256(data).hexdigest()}"'})
        return problem(404, "not-found", "there is no such thing")

    def _begin(self, request):
        [name] = request.query.get("filename") or [form_of(request)["mesh"][0]]
        if name == "refused.obj":
            return problem(400, "unreadable-mesh", "line 1 is no OBJ")
        number = f"j{next(self._numbers)}"
        self.names[number] = name
        return Reply({**self.job(number), "state": "queued", "summary": None}, 202)

    def job(self, number):
        name = self.names[number]
        if name == "failed.obj":
            failure = {"kind": "out-of-time", "detail": "it took long", "remedy": "wait"}
            return job("failed", id=number, name=name, failure=failure)
        return job("succeeded", id=number, name=name, summary=summary())


@pytest.fixture
def service():
    """A service and its address."""
    service = Service()
    with serving(service.answer) as address:
        yield service, address


@pytest.fixture
def mesh(tmp_path):
    def make(name, folder="."):
        path = tmp_path / folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(name)
        return path

    return make


def test_occluders_come_to_lie_beside_their_meshes(service, mesh, command, tmp_path):
    _, address = service
    done = command("submit", mesh("a.obj"), mesh("b.ply", "deeper"), "--server", address)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a_occluder.glb").read_text() == "a.obj occluder.glb"
    assert (tmp_path / "deeper" / "b_occluder.glb").read_text() == "b.ply occluder.glb"
    assert "a.obj: 15,044 -> 64 triangles, precision 99.80 %, recall 90.00 %" in done.stdout
    assert done.stderr == ""
    posts = [one for one in service[0].seen if one.path == "/v1/occluders"]
    assert [one.query["priority"] for one in posts] == [["bulk"]] * 2  # behind what people wait for


def test_a_batch_says_what_is_to_be_kept(service, mesh, command):
    server, address = service
    for keep in ("lean", "all"):
        done = command("submit", mesh(f"{keep}.obj"), "--server", address, "--keep", keep)
        assert done.returncode == 0, done.stderr
    posts = [one for one in server.seen if one.path == "/v1/occluders"]
    assert [one.query["keep"] for one in posts] == [["lean"], ["all"]]
    refused = command("submit", mesh("c.obj"), "--server", address, "--keep", "most")
    assert refused.returncode == 2
    assert "'most'" in refused.stderr


def test_other_formats_have_a_file_a_level_in_the_folder(service, mesh, here, tmp_path):
    _, address = service
    done = here(
        "submit", mesh("a.obj"), "-o", tmp_path / "out", "--format", "tres", OCCLUDER_SERVER=address
    )
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "a_occluder_lod0.tres", "a_occluder_lod1.tres",
    }  # fmt: skip


def test_where_no_folder_can_be_made_nothing_is_sent(service, mesh, here, tmp_path):
    served, address = service
    (tmp_path / "out").write_text("a file")
    done = here("submit", mesh("a.obj"), "--server", address, "-o", tmp_path / "out")
    assert done.returncode == 1
    assert "the folder cannot be made (File exists)" in done.stderr
    assert not served.seen


def test_only_what_was_chosen_is_sent(service, mesh, here):
    served, address = service
    here(
        "submit", mesh("a.obj"), "--server", address, "--key", "occ_x", "--budget", "32",
        "--ground", "--error-bounds", "0.1,0.4", "--asset", "props/{name}",
    )  # fmt: skip
    sent = served.seen[0]
    assert sent.query == {
        "budget": ["32"], "ground": ["true"], "error_bounds": ["0.1,0.4"],
        "asset": ["props/a"], "filename": ["a.obj"],
    }  # fmt: skip
    assert sent.headers["authorization"] == "Bearer occ_x"


def test_a_mesh_goes_with_the_overrides_beside_it(service, mesh, here, tmp_path):
    served, address = service
    (tmp_path / "a.overrides.toml").write_text("[ignore]\n")
    (tmp_path / "out").mkdir()
    done = here(
        "submit", mesh("a.obj"), mesh("b.obj"), "--server", address, "--budget", "32",
        "-o", tmp_path / "out",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "a.obj: 15,044 -> 64 triangles" in done.stdout
    sent = [one for one in served.seen if one.path == "/v1/occluders"]
    [form] = [form_of(one) for one in sent if not one.query]
    assert form["overrides"] == ("a.overrides.toml", "application/toml", b"[ignore]\n")
    assert form["mesh"][::2] == ("a.obj", b"a.obj")
    assert json.loads(form["options"][2]) == {"budget": 32}
    assert [one.query["filename"] for one in sent if one.query] == [["b.obj"]]


def test_overrides_are_not_looked_for_when_told_so(service, mesh, here, tmp_path):
    served, address = service
    (tmp_path / "a.overrides.toml").write_text("[ignore]\n")
    done = here("submit", mesh("a.obj"), "--server", address, "--no-overrides")
    assert done.returncode == 0, done.stderr
    assert (served.seen[0].query["filename"], served.seen[0].body) == (["a.obj"], b"a.obj")


def test_one_failure_does_not_keep_the_others_from_their_end(service, mesh, here, tmp_path):
    _, address = service
    meshes = [mesh(name) for name in ("refused.obj", "good.obj", "failed.obj")]
    done = here("submit", *meshes, tmp_path / "absent.obj", "--server", address)
    assert done.returncode == 1
    assert (tmp_path / "good_occluder.glb").exists()
    assert "refused.obj: line 1 is no OBJ; do better" in done.stderr
    assert "failed.obj: it took long; wait" in done.stderr
    assert "absent.obj: No such file" in done.stderr
    assert "error: 3 of 4 failed" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--format", "fbx"], "format: 'fbx' is not a format"),
        (["--budget", "0"], "budget"),
        (["--asset", "castle"], "put {name} into it"),
    ],
)
def test_wrong_usage_is_refused_before_anything_is_sent(service, mesh, here, arguments, said):
    served, address = service
    done = here("submit", mesh("a.obj"), mesh("b.obj"), "--server", address, *arguments)
    assert done.returncode == 2
    assert said in done.stderr
    assert served.seen == []


def test_no_occluder_replaces_another(service, mesh, here, tmp_path):
    _, address = service
    done = here(
        "submit", mesh("a.obj"), mesh("a.ply", "deeper"), "--server", address, "-o", tmp_path
    )
    assert done.returncode == 2
    assert "2 occluders would be written to it" in done.stderr


def test_a_server_that_is_not_there_is_said_so(mesh, here):
    done = here("submit", mesh("a.obj"), "--server", "http://127.0.0.1:9")
    assert done.returncode == 1
    assert "http://127.0.0.1:9 does not answer" in done.stderr


@pytest.mark.parametrize("server", ["127.0.0.1:1", "", "localhost:8000", "ftp://127.0.0.1"])
def test_an_address_without_http_is_said_to_be_none(mesh, here, server):
    done = here("submit", mesh("a.obj"), "--server", server)
    assert done.returncode == 1
    assert f"'{server}' is no address of a server" in done.stderr
    assert "the address needs http:// or https://" in done.stderr


def test_the_help_says_how_many_levels_the_service_makes(here):
    words = " ".join(here("submit", "--help").stdout.replace("│", " ").split())
    assert f"half the triangles of the one before. [default: ({LEVELS})]" in words


def test_ctrl_c_cancels_what_was_begun(service, mesh, declared):
    served, address = service
    with subprocess.Popen(
        [*OCCLUDER, "submit", mesh("endless.obj"), "--server", address],
        env=environment(PYTHONPATH=declared), stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert served.waited_for.wait(20)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=20)
    assert process.returncode == 130
    assert served.cancelled.is_set()
    assert "interrupted; what was under way is cancelled" in said
    assert "Traceback" not in said
