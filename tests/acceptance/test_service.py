"""The service as its users meet it: real processes, from the first curl to the last signal."""

from __future__ import annotations

import json
import logging
import os
import re
import resource
import signal
import socket
import subprocess
import urllib.request
from contextlib import suppress
from pathlib import Path

import pytest

import simplifier
from bench.visibility_city import generated_city
from service.client import Client, ClientError
from service.jobs.job import JobState
from simplifier.io.scene_writer import write_scene
from tests.acceptance.command import ROOT, occluder
from tests.acceptance.curl import curled, needs_curl
from tests.faults.serving import LIGHT_WORK, SURROUNDINGS
from tests.service.declared import declare
from tests.service.real import BOX, QUICK, running
from tests.waiting import until

LONG = {"budget": 11, "preset": "best", "time_limit": 60.0, "views": 4, "image": 32}


@pytest.fixture(scope="module")
def declared(tmp_path_factory):
    return os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])


@pytest.fixture(scope="module")
def lightly(declared):
    """For ``running``: workers that do no work to speak of, where the library's is no matter."""
    return {
        "declared": os.pathsep.join([str(SURROUNDINGS), declared]), "FAULTS_WORK": str(LIGHT_WORK),
        "OCCLUDER_DASHBOARD": "false",
    }  # fmt: skip


@pytest.fixture(scope="module")
def server(declared, tmp_path_factory):
    """One for all tests that leave it as it was."""
    with running(declared, tmp_path_factory.mktemp("served") / "data") as server:
        yield server
        assert "Traceback" not in server.log.read_text()


@pytest.fixture
def client(server):
    with Client(server.address) as client:
        yield client


@pytest.fixture
def command(declared, tmp_path):
    def run(*arguments, **variables):
        return occluder(*arguments, cwd=tmp_path, **{"PYTHONPATH": declared, **variables})

    return run


@pytest.fixture
def served_here(declared, here, monkeypatch, tmp_path):
    """The same in this process: for what ends before a server listens."""
    for folder in reversed(declared.split(os.pathsep)):
        monkeypatch.syspath_prepend(folder)
    for name in ("service", "uvicorn"):
        monkeypatch.setattr(logging.getLogger(name), "level", logging.NOTSET)
    files = resource.getrlimit(resource.RLIMIT_NOFILE)

    def run(*arguments, **variables):
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        return here(*arguments, cwd=tmp_path)

    yield run
    resource.setrlimit(resource.RLIMIT_NOFILE, files)


@needs_curl
def test_the_curl_of_the_readme_gives_an_occluder(server, tmp_path):
    assert 0 < len(curled("README.md", server, tmp_path, "preset=draft&").faces) <= 64


@needs_curl
def test_the_curl_of_the_docs_gives_the_sets_that_the_command_finds(
    server, client, served_here, tmp_path
):
    write_scene(generated_city(2), tmp_path / "town.glb")
    text = (ROOT / "docs/service.md").read_text()
    curl = re.search(r"```sh\n(curl [^`]*/v1/visibility[^`]*)```", text)[1]
    curl = curl.replace("http://127.0.0.1:8000", server.address)
    curl = curl.replace("&ground=true", "&ground=true&up=z")  # of the city here
    done = subprocess.run(["bash", "-c", curl], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    command = ("pvs", "town.glb", "-o", "own.pvs", "--up", "z", "--ground", "--report", "own.json")
    assert served_here(*command).returncode == 0
    assert (tmp_path / "town.pvs").read_bytes() == (tmp_path / "own.pvs").read_bytes()

    pvs = simplifier.load_pvs(tmp_path / "town.pvs")
    job = next(client.jobs())
    assert (job.kind, job.state, job.summary.levels) == ("visibility", "succeeded", len(pvs.cells))
    told = client.result(job.id).report
    own = json.loads((tmp_path / "own.json").read_text())
    clock = {"seconds_a_cell": None, "cost": None, "foretold": None}
    assert told | clock == own | clock
    assert told["culled_share"] > 0.2


POST = "[[box]]\ncenter = [1.4, 0.5, 0.5]\nsize = [0.2, 0.2, 0.2]\n"
"""Drawn beside the box, where nothing would come by itself; further off, pictures grow with it."""


@needs_curl
def test_the_curl_of_the_docs_with_json_makes_an_asset(server):
    text = (ROOT / "docs/service.md").read_text()
    curl = re.search(r"```sh\n(curl [^`]*/v1/assets[^`]*)```", text)[1]
    curl = curl.replace("http://127.0.0.1:8000", server.address)
    done = subprocess.run(["bash", "-c", curl], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    made = json.loads(done.stdout)
    assert (made["name"], made["thresholds"]["min_recall"]) == ("props/castle", 0.8)


def reach(mesh):
    return mesh.vertices[:, 0].max()


@pytest.mark.slow
@needs_curl
def test_the_curl_with_overrides_gives_what_they_draw(server, tmp_path):
    (tmp_path / "castle.overrides.toml").write_text(POST)
    made = curled("docs/overrides.md", server, tmp_path, "preset=draft&")
    assert reach(made) == pytest.approx(1.5)


@pytest.mark.slow
def test_submit_sends_the_overrides_beside_a_mesh(server, command, served_here, tmp_path):
    (tmp_path / "box.obj").write_bytes(BOX)
    (tmp_path / "box.overrides.toml").write_text(POST)
    made, quick = tmp_path / "box_occluder.glb", ("--lods", "1", "--preset", "draft")
    done = command("submit", "box.obj", "--server", server.address, *quick)
    assert done.returncode == 0, done.stderr
    assert reach(simplifier.load(made)) == pytest.approx(1.5)
    done = served_here("submit", "box.obj", "--server", server.address, "--no-overrides", *quick)
    assert done.returncode == 0, done.stderr
    assert reach(simplifier.load(made)) < 1.2
    (tmp_path / "box.overrides.toml").write_text("[[box]]\n")
    done = served_here("submit", "box.obj", "--server", server.address, *quick)
    assert done.returncode == 1
    assert "error: box.obj: box.overrides.toml:1: 'center' is missing" in done.stderr


def test_submit_writes_occluders_and_prints_figures(server, command, tmp_path):
    (tmp_path / "box.obj").write_bytes(BOX)
    (tmp_path / "broken.obj").write_bytes(b"f 1 2 3\n")
    done = command(
        "submit", "box.obj", "broken.obj", "--server", server.address, "--preset", "draft",
        "--asset", "props/{name}",
    )  # fmt: skip
    assert done.returncode == 1
    assert re.search(
        r"box.obj: good, 12 -> \d+ triangles, precision \d+\.\d+ %, recall .*, overhang 0.00 %;",
        done.stdout,
    )
    assert "error: broken.obj: " in done.stderr
    assert str(tmp_path) not in done.stdout
    assert len(simplifier.load_lods(tmp_path / "box_occluder.glb").levels) >= 1


SENT = (
    {
        "budget": 24, "resolution": 12, "lods": 2, "pixel_error": 2.0, "screen_height": 720,
        "fov": 70.0, "up": "z", "ground": True, "viewers": "above", "transparent": "keep",
        "smallest_hole": 0.1, "trim": "area", "alpha": 0.01,
        "preset": "draft", "min_precision": 0.9, "moves": 10, "seed": 3, "views": 4, "image": 32,
        "quads": 64, "memory_limit": 1.5,
    },
    {
        "error_share": 0.1, "viewers": "inside", "eye_height": 0.2, "fill": "flood",
        "conservative": True, "shrink": 0.01, "overhang": 0.1, "front": 0.2, "time_limit": 1.0,
        "exact": True,
    },
    {"error_bound": 0.2},
    {"error_bounds": [0.1, 0.2]},
)  # fmt: skip
"""Options, none at its default: all that a service lets its callers choose, for four jobs."""


def test_submit_sends_every_option(lightly, tmp_path):
    of_server = {"slicer", "device"}
    assert {name for one in SENT for name in one} == {
        field.name for field in simplifier.SimplifyOptions.fields()
    } - of_server
    (tmp_path / "box.obj").write_bytes(BOX)
    with running(data=tmp_path / "data", **lightly) as server, Client(server.address) as client:
        for options in SENT:
            done = occluder(
                "submit", "box.obj", "--server", server.address, "--format", "obj",
                "--at-once", "1", *_as_arguments(options),
                cwd=tmp_path, PYTHONPATH=lightly["declared"],
            )  # fmt: skip
            assert done.returncode == 0, done.stderr
            last = next(client.jobs())
            assert {name: last.options[name] for name in options} == options


def _as_arguments(options):
    for name, value in options.items():
        yield f"--{name.replace('_', '-')}"
        if isinstance(value, list):
            yield ",".join(map(str, value))
        elif value is not True:
            yield str(value)


def test_every_format_comes_as_it_is_asked_for(client, tmp_path):
    job = client.wait(client.submit(BOX, name="box.obj", options={"preset": "draft"}).id)
    assert job.state is JobState.SUCCEEDED, job.failure
    result = client.result(job.id)
    for form, name in result.levels[0].files.items():
        simplifier.load(client.fetch(job.id, name, tmp_path / f"box.{form}"))
    assert result.levels[0].recall == pytest.approx(job.summary.recall)
    assert {"report.json", "input/mesh.obj"} <= {file.name for file in result.files}
    page = client.fetch(job.id, result.pages["report"], tmp_path / "report.html")
    assert "<title>Occluder of box.obj" in page.read_text()


def test_progress_is_told_and_a_cancelled_job_ends_soon(client):
    job = client.submit(BOX, name="long.obj", options=LONG)
    for now in client.watch(job.id):
        if now.progress is not None and now.progress.measure is not None:
            client.cancel(job.id)
            break
    assert client.wait(job.id).state is JobState.CANCELLED


def test_a_job_that_would_need_too_much_memory_fails_before_it_begins(client):
    options = {**QUICK, "resolution": 900, "memory_limit": 0.25}
    failure = client.wait(client.submit(BOX, name="box.obj", options=options).id).failure
    assert failure.kind == "out-of-memory"
    assert re.match(r"about \d+\.\d+ GiB of memory would be needed, most of it to ", failure.detail)
    assert re.match(r"choose a resolution of at most \d+, or raise ", failure.remedy)


def test_options_are_refused_field_by_field(client):
    with pytest.raises(ClientError) as refused:
        client.submit(BOX, name="box.obj", options={"budget": 0, "colour": "red"})
    assert refused.value.problem.status == 422
    assert {one.field for one in refused.value.problem.errors} == {"budget", "colour"}


def test_an_asset_keeps_the_history_of_its_runs(client):
    for budget in (8, 16):
        job = client.submit(
            BOX, name="box.obj", options={**QUICK, "budget": budget}, asset="props/history"
        )
        assert client.wait(job.id).state is JobState.SUCCEEDED
    asset = client.asset_named("props/history")
    assert asset.runs == 2
    assert [run["options"]["budget"] for run in client.runs(asset.id)] == [16, 8]
    assert client.compare(asset.id)["options_changed"] == {"budget": [8, 16]}


def test_the_server_imports_nothing_heavy(client, server):
    client.wait(client.submit(BOX, name="box.obj", options=QUICK).id)
    try:
        libraries = Path(f"/proc/{server.process.pid}/maps").read_text()
    except PermissionError:
        pytest.skip("a server hides its memory from all but root")
    for heavy in ("numpy", "numba", "llvmlite", "scipy", "cv2", "matplotlib"):
        assert heavy not in libraries


# What 'serve' refuses.


@pytest.mark.parametrize(
    ("arguments", "variables", "said"),
    [
        (["--host", "0.0.0.0"], {}, "occluder keys create"),
        (["--port", "70000"], {}, "OCCLUDER_PORT cannot be 70000"),
        ([], {"OCCLUDER_WORKERS": "none"}, "OCCLUDER_WORKERS cannot be 'none'"),
    ],
)
def test_settings_that_cannot_be_are_refused_in_a_line(served_here, arguments, variables, said):
    assert_refused_in_a_line(served_here("serve", "--port", "0", *arguments, **variables), said)


@pytest.mark.parametrize(
    ("arguments", "variables", "said"),
    [
        (["--host", "203.0.113.7"], {"OCCLUDER_REQUIRE_KEYS": "false"}, "cannot listen on"),
        (["--data", "/proc/occluder"], {}, "/proc/occluder"),
    ],
)
def test_what_cannot_be_served_is_refused_in_a_line(served_here, arguments, variables, said):
    assert_refused_in_a_line(served_here("serve", "--port", "0", *arguments, **variables), said)


def assert_refused_in_a_line(done, said):
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_port_that_is_taken_is_refused(served_here):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        done = served_here("serve", "--port", str(taken.getsockname()[1]))
    assert done.returncode == 2
    assert "choose another --host or --port" in done.stderr


def test_a_data_folder_has_one_server(server, command):
    done = command("serve", "--port", "0", "--data", server.log.with_suffix(""))
    assert done.returncode == 2
    assert "is used by another server" in done.stderr


def test_a_key_opens_what_is_closed_without(lightly, served_here, tmp_path):
    data = tmp_path / "data"
    made = served_here(
        "keys", "create", "--name", "test", "--scope", "write", OCCLUDER_DATA=str(data)
    )
    assert made.returncode == 0, made.stderr
    [key] = re.findall(r"occ_[\w-]{40,}", made.stdout)
    with running(data=data, OCCLUDER_REQUIRE_KEYS="true", **lightly) as server:
        with Client(server.address) as stranger, pytest.raises(ClientError) as refused:
            stranger.submit(BOX, name="box.obj")
        assert refused.value.problem.status == 401
        with Client(server.address, key=key) as client:
            job = client.wait(client.submit(BOX, name="box.obj", options=QUICK).id)
        assert job.state is JobState.SUCCEEDED
    assert key not in server.log.read_text()


# How it ends.


@pytest.mark.faults
def test_sigterm_gives_running_jobs_back_and_a_second_signal_waits_for_none(
    declared, lightly, tmp_path
):
    with running(declared, tmp_path / "data") as server, Client(server.address) as client:
        # The second time by light work, which reads it and is ready at once.
        job = client.submit(b"# occupy 60\n" + BOX, name="long.obj", options=LONG)
        until(lambda: client.job(job.id).state is JobState.RUNNING)
        workers = server.workers
        with urllib.request.urlopen(f"{server.address}/v1/jobs/{job.id}/events") as stream:
            stream.readline()  # somebody follows
            assert server.end() == 0
        until(lambda: not any(alive(pid) for pid in workers))
        assert "Traceback" not in server.log.read_text()
    with running(data=tmp_path / "data", **lightly) as server, Client(server.address) as client:
        again = until(lambda: running_job(client, job.id))
        # What the server itself broke off costs no attempt: as many are left as before.
        assert again.attempts - again.attempt == job.attempts - 1
        # A second signal ends it at once.
        with urllib.request.urlopen(f"{server.address}/v1/jobs/{job.id}/events") as stream:
            stream.readline()  # somebody follows, so there is something to wait for
            server.process.send_signal(signal.SIGINT)
            assert server.end(signal.SIGINT) in (0, 130)


@pytest.mark.faults
def test_kill_9_loses_no_job_and_does_none_twice(declared, lightly, tmp_path):
    data = tmp_path / "data"
    with running(declared, data) as server, Client(server.address) as client:
        first = client.submit(BOX, name="long.obj", options={**LONG, "time_limit": 1.0})
        until(lambda: client.job(first.id).state is JobState.RUNNING)
        quick = [
            client.submit(BOX, name="box.obj", options={**QUICK, "seed": seed}) for seed in range(3)
        ]
        workers = server.workers
        assert workers
        server.end(signal.SIGKILL)
        until(lambda: not any(alive(pid) for pid in workers))
    # Those that are left by light work: it is the queue that is looked at.
    with running(data=data, **lightly) as server, Client(server.address) as client:
        ended = [client.wait(job.id) for job in (first, *quick)]
        assert [job.state for job in ended] == [JobState.SUCCEEDED] * 4
        assert ended[0].attempt == 2
        assert len(list(client.jobs())) == 4
        with urllib.request.urlopen(f"{server.address}/readyz") as answer:
            assert json.load(answer)


def running_job(client, job_id):
    job = client.job(job_id)
    return job if job.state is JobState.RUNNING else None


def alive(pid):
    with suppress(OSError):
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False
