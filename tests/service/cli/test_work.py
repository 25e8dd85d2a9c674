"""``occluder work``: jobs of a server done by processes that answer nobody."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass

import httpx
import pytest

from service.cli.worker_host import ending, watch
from service.jobs.progress import ProgressBoard
from tests.acceptance.command import OCCLUDER, environment
from tests.faults.serving import LIGHT_WORK, SURROUNDINGS
from tests.service.real import BOX, running
from tests.waiting import BUSY, until

LEASE = "2"


@dataclass
class Cluster:
    """A server that leaves its jobs to others, and how to have others."""

    declared: str
    variables: dict
    http: httpx.Client
    folder: os.PathLike
    workers: int = 0

    @contextmanager
    def working(self, *arguments, **variables):
        """A worker's process."""
        self.workers += 1
        data = self.folder / f"worker {self.workers}"
        with data.with_suffix(".log").open("w") as log:
            process = subprocess.Popen(
                [*OCCLUDER, "work", "--data", data, *arguments], stdout=subprocess.PIPE,
                stderr=log, text=True,
                env=environment(PYTHONPATH=self.declared, **self.variables | variables),
            )  # fmt: skip
        process.log = data.with_suffix(".log")
        with process:
            try:
                line = process.stdout.readline()
                assert line.startswith("occluder works"), process.log.read_text()
                yield process
            finally:
                process.kill()

    def submit(self, first_line="#"):
        body = f"{first_line}\n# {time.monotonic_ns()}\n".encode() + BOX
        answer = self.http.post("/v1/occluders?filename=box.obj", content=body)
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def job(self, job_id):
        return self.http.get(f"/v1/jobs/{job_id}").raise_for_status().json()

    def end_of(self, job_id):
        def ended():
            job = self.job(job_id)
            return job["state"] in ("succeeded", "failed", "cancelled") and job

        return until(ended, BUSY)

    def is_running(self, job_id):
        return self.job(job_id)["state"] == "running"


@pytest.fixture(scope="module")
def shared(postgres, moto, tmp_path_factory):
    """Settings of all that share a database and a bucket."""
    secret = tmp_path_factory.mktemp("secret") / "secret"
    secret.write_bytes(os.urandom(32))
    secret.chmod(0o600)
    address = postgres.database()
    yield {
        "OCCLUDER_DATABASE_URL": address, "OCCLUDER_SECRET_FILE": str(secret),
        "OCCLUDER_BLOBS": f"s3://{moto.new_bucket()}/studio", **moto.variables,
    }  # fmt: skip
    postgres.drop(address)


@pytest.fixture(scope="module")
def cluster(declared, shared, tmp_path_factory):
    folder = tmp_path_factory.mktemp("cluster")
    path = os.pathsep.join([str(SURROUNDINGS), declared])
    settings = {
        **shared, "FAULTS_WORK": str(LIGHT_WORK), "OCCLUDER_LEASE_SECONDS": LEASE,
        "OCCLUDER_WORKERS": "1",
    }  # fmt: skip
    # A worker signs nothing, and what a server does with jobs is no affair of its.
    mine = {**settings, "OCCLUDER_SECRET_FILE": None, "OCCLUDER_ENGINE": "none"}
    with (
        running(
            path, folder / "data", OCCLUDER_ENGINE="none", OCCLUDER_DASHBOARD="false", **settings
        ) as server,
        httpx.Client(base_url=server.address, timeout=BUSY) as http,
    ):
        yield Cluster(path, mine, http, folder)


def test_a_worker_does_what_waits_and_ends_when_nothing_does(cluster):
    ids = [cluster.submit() for _ in range(3)] + [cluster.submit("# die")]
    with cluster.working("--until-idle", "1.5") as worker:
        assert worker.wait(BUSY) == 0
    states = [cluster.job(one)["state"] for one in ids]
    assert states[:3] == ["succeeded"] * 3
    # The last costs its process, waits longer and longer, and is left to who comes next.
    assert cluster.job(ids[3])["attempt"] >= 1
    assert "jobs that ended here: 3 succeeded" in worker.log.read_text()
    assert "Traceback" not in worker.log.read_text()
    cluster.http.post(f"/v1/jobs/{ids[3]}/cancel")


def test_a_file_of_a_job_is_served_by_who_has_not_done_it(cluster):
    with cluster.working():
        job_id = cluster.submit("# elsewhere")
        cluster.end_of(job_id)
    file = cluster.http.get(f"/v1/jobs/{job_id}/files/lod0.obj")
    assert file.content.startswith(b"# elsewhere\n")


@pytest.mark.faults
def test_one_that_is_told_to_end_gives_its_job_back_at_no_cost(cluster, tmp_path):
    gate = tmp_path / "gate"
    job_id = cluster.submit(f"# wait {gate}")
    with cluster.working() as worker:
        until(lambda: cluster.is_running(job_id))
        worker.send_signal(signal.SIGTERM)
        assert worker.wait(BUSY) == 0
    job = cluster.job(job_id)
    assert (job["state"], job["attempts"] - job["attempt"]) == ("queued", 3)
    gate.touch()
    with cluster.working("--until-idle", "0.5") as worker:
        assert worker.wait(BUSY) == 0
    assert cluster.job(job_id)["state"] == "succeeded"


def test_the_end_of_a_job_is_heard_on_other_machines(cluster, tmp_path):
    with cluster.working() as worker:
        job_id = cluster.submit(f"# wait {tmp_path / 'never'}")
        until(lambda: cluster.is_running(job_id))
        cluster.http.post(f"/v1/jobs/{job_id}/cancel")
        assert cluster.end_of(job_id)["state"] == "cancelled"
        worker.send_signal(signal.SIGINT)
        assert worker.wait(BUSY) == 0


@pytest.mark.faults
def test_the_job_of_one_that_is_killed_is_done_by_another(cluster, tmp_path):
    gate = tmp_path / "gate"
    job_id = cluster.submit(f"# wait {gate}")
    with cluster.working() as worker:
        until(lambda: cluster.is_running(job_id))
        worker.kill()
    gate.touch()
    with cluster.working():
        job = cluster.end_of(job_id)
    assert (job["state"], job["attempt"]) == ("succeeded", 2)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"OCCLUDER_DATABASE_URL": None}, "set OCCLUDER_DATABASE_URL"),
        ({"OCCLUDER_DATABASE_URL": "postgresql://me@127.0.0.1:1/jobs"}, "check that PostgreSQL"),
        ({"OCCLUDER_BLOBS": None}, "set OCCLUDER_BLOBS=s3://BUCKET/PREFIX"),
        ({"OCCLUDER_WORKERS": "many"}, "OCCLUDER_WORKERS cannot be 'many'"),
    ],
)
def test_what_is_set_up_wrongly_is_a_line_and_status_2(here, shared, changes, told):
    given = {name: value for name, value in (shared | changes).items() if value is not None}
    begun = time.monotonic()
    refused = here("work", "--until-idle", "0", **given)
    assert refused.returncode == 2, refused.stderr
    (line,) = refused.stderr.splitlines()
    assert told in line
    assert time.monotonic() - begun < 15.0


def test_one_of_another_release_is_refused(here, postgres, moto, shared):
    address = postgres.database()
    own = {"OCCLUDER_DATABASE_URL": address, "OCCLUDER_BLOBS": f"s3://{moto.new_bucket()}"}
    name = address.rpartition("/")[2]
    postgres.execute("UPDATE deployment SET release = '9.0'", name)
    refused = here("work", **shared | own)
    assert (refused.returncode, "install 9.0 here" in refused.stderr) == (2, True), refused.stderr
    postgres.drop(address)


def test_two_do_not_share_a_folder(cluster, here):
    with cluster.working():
        folder = cluster.folder / f"worker {cluster.workers}"
        variables = {name: value for name, value in cluster.variables.items() if value}
        refused = here("work", "--data", folder, **variables)
    assert refused.returncode == 2
    assert "OCCLUDER_DATA" in refused.stderr


class Stuck:
    """An engine that cannot work."""

    idle_seconds, problem = None, "worker processes die before they are ready"


def test_one_that_cannot_work_fails_if_it_was_to_end_by_itself(monkeypatch):
    monkeypatch.setattr("service.cli.worker_host._HOPELESS_SECONDS", 0.3)
    assert watch(Stuck(), ProgressBoard(), threading.Event(), 0.0) == Stuck.problem
    end = threading.Event()
    threading.Timer(1.0, end.set).start()
    assert watch(Stuck(), ProgressBoard(), end, None) is None  # which waits for better


def test_the_first_signal_is_an_order_and_what_was_before_comes_back():
    before = signal.getsignal(signal.SIGTERM)
    with ending() as end:
        os.kill(os.getpid(), signal.SIGTERM)
        assert end.wait(1.0)
    assert signal.getsignal(signal.SIGTERM) is before
