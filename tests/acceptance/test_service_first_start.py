"""A server that has to compile first: what it says of itself, and what the README's curl gets."""

from __future__ import annotations

import os
import threading
import time

import httpx
import pytest

from tests.acceptance.command import ROOT
from tests.acceptance.curl import curl, curled, needs_curl
from tests.faults.serving import SURROUNDINGS
from tests.service.declared import declare
from tests.service.real import running
from tests.waiting import until

PAGES = ["README.md", "docs/service.md"]
"""Whose curls differ in options alone, so that one of them waits for a compiler every day."""

SLOW_START = """
import os
import time
from pathlib import Path
from service.engines.failures import program_fault
from service.engines.worker import TaskFailedError
from service.jobs.job import Summary


def start():
    with Path(os.environ["FAULTS_STARTS"]).open("a") as file:
        file.write("x")
    while not Path(os.environ["FAULTS_COMPILED"]).exists():
        time.sleep(0.01)
    return work


def work(task, tell, cancel):
    if task.options["seed"] == 13:
        raise TaskFailedError(program_fault(KeyError()))
    mesh = Path(task.inputs["mesh"]).read_bytes()
    (Path(task.results) / "occluder.glb").write_bytes(mesh)
    return Summary(12, 12, 1, 0.1, precision=1.0, recall=0.5)
"""


@pytest.fixture(scope="module")
def declared(tmp_path_factory):
    return os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])


def slow_to_start(declared, folder):
    """A server of two workers that compile until the file ``compiled`` is in the folder."""
    (folder / "slow_start.py").write_text(SLOW_START)
    return running(
        os.pathsep.join([str(SURROUNDINGS), declared]), folder / "data",
        FAULTS_WORK=str(folder / "slow_start.py"), FAULTS_STARTS=str(folder / "starts"),
        FAULTS_COMPILED=str(folder / "compiled"), OCCLUDER_WORKERS="2", OCCLUDER_MAX_WAIT="1",
        OCCLUDER_DASHBOARD="false",
    )  # fmt: skip


@pytest.fixture
def cold(declared, tmp_path):
    """One that has not compiled yet."""
    with slow_to_start(declared, tmp_path) as server:
        yield server


@pytest.fixture(scope="module")
def warm(declared, tmp_path_factory):
    """One that has nothing to compile."""
    folder = tmp_path_factory.mktemp("warm")
    (folder / "compiled").touch()
    with slow_to_start(declared, folder) as server:
        yield server


def not_ready(server):
    """What keeps the server from being ready; empty where nothing does."""
    answer = httpx.get(f"{server.address}/readyz")
    return answer.json().get("detail", "")


@needs_curl
@pytest.mark.parametrize("page", [PAGES[0], pytest.param(PAGES[1], marks=pytest.mark.slow)])
def test_the_documented_curl_waits_for_the_kernels(cold, tmp_path, page):
    until(lambda: (tmp_path / "starts").exists())
    assert not_ready(cold).startswith("kernels: they are made ready")

    def follow():
        job = until(lambda: httpx.get(f"{cold.address}/v1/jobs").json()["items"])[0]
        said.append((job["state"], job["progress"]["stage"]))
        time.sleep(1.5)  # longer than an answer waits
        said.append((tmp_path / "starts").read_text())
        (tmp_path / "compiled").touch()

    said = []
    follower = threading.Thread(target=follow)
    follower.start()
    made = curled(page, cold, tmp_path)
    follower.join()
    assert len(made.faces) == 12
    assert said == [("queued", "preparing"), "x"]  # one of two
    assert not not_ready(cold)
    until(lambda: (tmp_path / "starts").read_text() == "xx")


@needs_curl
@pytest.mark.parametrize("page", PAGES)
def test_the_documented_curl_fails_with_the_job(warm, tmp_path, page):
    done = curl(page, warm, tmp_path, "seed=13&")
    assert done.returncode == 22  # of curl, for a status of 400 and more
    assert b"job-failed" in (tmp_path / "castle_occluder.glb").read_bytes()


@pytest.mark.slow
@needs_curl
def test_kernels_are_compiled_once_and_the_curl_waits(declared, tmp_path):
    """With an empty cache, for real: a minute or two."""
    cache = tmp_path / "cache"
    variables = {"OCCLUDER_WORKERS": "2", "OCCLUDER_DASHBOARD": "false"}  # its helper is no worker
    with running(declared, tmp_path / "data", NUMBA_CACHE_DIR=str(cache), **variables) as server:
        until(lambda: server.workers)
        counts = []

        def count():
            while not_ready(server):
                counts.append(len(server.workers))
                time.sleep(0.1)

        counter = threading.Thread(target=count)
        counter.start()
        made = curled("README.md", server, tmp_path)
        counter.join()
        assert 0 < len(made.faces) <= 64
        assert set(counts[:-1]) == {1}  # the last look may come when the second has begun
        until(lambda: len(server.workers) == 2)
        written = times_in(cache)
        assert written
        for seed in range(4):  # by either of the two
            curled("README.md", server, tmp_path, f"seed={seed}&")
        assert times_in(cache) == written


def times_in(cache):
    """When each file of compiled kernels was written."""
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*.o")}
