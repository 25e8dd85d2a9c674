"""A server that is killed and started again, at one address and on one folder."""

from __future__ import annotations

import hashlib
import os
import random
import signal
import socket
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

import httpx

from tests.acceptance.command import OCCLUDER, ROOT, environment
from tests.service.declared import declare
from tests.service.real import BOX, running
from tests.waiting import until

TIMEOUT = 60.0
LIGHT_WORK = Path(__file__).with_name("light_work.py")
SURROUNDINGS = Path(__file__).with_name("surroundings")


def path_of_processes(folder):
    """What goes on the path of servers and workers under test; ``folder`` declares them."""
    return os.pathsep.join(map(str, [SURROUNDINGS, declare(folder), ROOT]))


class Server:
    """Also what its clients need: requests by :mod:`httpx`, each by a connection of its own."""

    def __init__(self, declared, data, *arguments, **variables):
        self.data = data
        self.address = f"http://127.0.0.1:{_free_port()}"
        self._arguments = ["--port", self.address.rpartition(":")[2], *arguments]
        self._declared, self._variables = declared, variables
        self._http = httpx.Client(
            base_url=self.address, timeout=TIMEOUT,
            limits=httpx.Limits(max_keepalive_connections=0),
        )  # fmt: skip
        self._life = ExitStack()
        self._now = None

    @property
    def process(self):
        return self._now.process

    @property
    def workers(self):
        """Process ids."""
        return self._now.workers

    @property
    def log(self):
        """What all of its lives have written."""
        return self.data.with_suffix(".log").read_text()

    def start(self, **variables):
        """Returns itself once it listens; ``variables`` hold for this life alone."""
        self._now = self._life.enter_context(
            running(self._declared, self.data, *self._arguments, **self._variables | variables)
        )
        return self

    def kill(self):
        self._end(signal.SIGKILL)

    def stop(self):
        assert self._end(signal.SIGTERM) == 0, self.log

    def _end(self, number):
        if self._now is None:
            return None
        status = self._now.end(number)
        self._now = None
        self._life.close()
        return status

    def refused(self):
        """Start one that is to refuse: its exit status and what it says."""
        done = subprocess.run(
            [*OCCLUDER, "serve", "--data", self.data, *self._arguments],
            env=environment(PYTHONPATH=self._declared, **self._variables),
            capture_output=True, text=True, timeout=TIMEOUT, check=False,
        )  # fmt: skip
        return done.returncode, done.stderr

    def get(self, path):
        return self._http.get(path)

    def post(self, path="/v1/occluders?filename=box.obj", body=BOX, headers=None):
        return self._http.post(path, content=body, headers=headers)

    def stream(self, path):
        """An answer as it comes, for a ``with`` statement."""
        return self._http.stream("GET", path)

    def submit(self, first_line="#", query=""):
        """A job's id; ``first_line`` of the mesh says what its work does."""
        answer = self.post(
            f"/v1/occluders?filename=box.obj{query}", f"{first_line}\n".encode() + BOX
        )
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def job(self, job_id):
        return self.get(f"/v1/jobs/{job_id}").raise_for_status().json()

    def jobs(self):
        """All, newest first."""
        page, found = "/v1/jobs?limit=100", []
        while page:
            body = self.get(page).raise_for_status().json()
            found += body["items"]
            page = body["next"]
        return found

    def end_of(self, job_id, seconds=TIMEOUT):
        """The job once it has ended; each look at it takes 10 ms of processor time."""
        pause = 0.0

        def ended():
            nonlocal pause
            time.sleep(pause)
            pause = min(0.1, pause + 0.01)
            job = self.job(job_id)
            return job["ended"] and job

        return until(ended, seconds)

    def is_ready(self):
        return self.get("/readyz").status_code == 200

    def assert_served_whole(self, job_id):
        """Each file of a job has the bytes that its digest promises."""
        for file in self.get(f"/v1/jobs/{job_id}/files").raise_for_status().json()["items"]:
            assert hashlib.sha256(self.get(file["link"]).content).hexdigest() == file["sha256"]


def _free_port():
    """Below those that systems give out, so that nobody has it while the server is away."""
    while True:
        port = random.randrange(20_000, 32_000)
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) != 0:
                return port


def memory_of(pid):
    """Resident bytes of a process."""
    status = Path(f"/proc/{pid}/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) * 1024
