"""Clients who post jobs while a server is hurt, and what has to be left when all has ended."""

from __future__ import annotations

import json
import random
import re
import threading
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor

import httpx

from tests.faults.light_work import RESULTS
from tests.faults.remains import assert_folder_is_clean, jobs_left
from tests.service.real import BOX, QUICK
from tests.waiting import until

CLIENTS = 4
UNDER_WAY = 8
"""Jobs that clients have not heard the end of, so that some are posted all the time."""
PATIENCE = 600.0


def slow_box(number):
    """A mesh that is posted once, and takes light work a while."""
    return f"# occupy 0.2\n# {number}\n".encode() + BOX


class Clients:
    """Post jobs by turns, each under a key of its own until it was answered; cancel some."""

    def __init__(self, server, receiver, jobs, seed, mesh=slow_box):
        self._server, self._receiver, self._jobs, self._seed = server, receiver, jobs, seed
        self._mesh = mesh
        self._lock = threading.Lock()
        self._heard, self._read = defaultdict(list), 0
        self.accepted = {}  # job ids by number
        self.cancelled = set()  # job ids
        self.lost = 0  # requests without an answer
        self.unwanted = threading.Event()

    def run(self):
        with ThreadPoolExecutor(CLIENTS) as pool:
            list(pool.map(self._post, range(self._jobs)))

    def deliveries(self):
        """Ids of those that were heard, by job."""
        with self._lock:
            heard = self._receiver.heard
            for one in heard[self._read : len(heard)]:  # asked for all the time
                self._heard[json.loads(one.body)["job"]["id"]].append(
                    one.headers["occluder-delivery"]
                )
                self._read += 1
            return dict(self._heard)

    def _post(self, number):
        rng = random.Random(f"{self._seed} {number}")
        until(lambda: self.unwanted.is_set() or self._may_post(), PATIENCE)
        job_id = self._submit(number)
        with self._lock:
            self.accepted[number] = job_id
        if rng.random() < 0.3:
            assert self._submit(number) == job_id
        if rng.random() < 0.1:
            with self._lock:
                self.cancelled.add(job_id)
            answer = self._answered(f"/v1/jobs/{job_id}/cancel")
            assert answer.status_code in (200, 409), answer.text

    def _may_post(self):
        return len(self.accepted) - len(self.deliveries()) < UNDER_WAY

    def _submit(self, number):
        options = "&".join(f"{name}={value}" for name, value in QUICK.items())
        answer = self._answered(
            f"/v1/occluders?filename=box.obj&{options}&webhook={self._receiver.url}",
            self._mesh(number),
            {"Idempotency-Key": f"{self._seed}-{number}"},
        )
        assert answer.status_code in (200, 202), answer.text
        return answer.headers["Location"].rpartition("/")[2]

    def _answered(self, path, body=b"", headers=None):
        """Ask until there is an answer."""

        def ask():
            assert not self.unwanted.is_set()
            try:
                answer = self._server.post(path, body, headers)
            except httpx.TransportError:
                with self._lock:
                    self.lost += 1
                return None
            return None if answer.status_code in (429, 503) else answer

        return until(ask, PATIENCE)


def stop_cleanly(serving):
    """End a server once it has removed what is not needed."""
    serving.stop()
    cleaned = serving.log.count("cleaning freed")
    serving.start()
    until(lambda: serving.log.count("cleaning freed") > cleaned)
    serving.stop()


def assert_each_ended_once(serving, clients, deliveries, jobs):
    """Of a server that has stopped; the rows that are left."""
    left = jobs_left(serving.data)
    assert_jobs_ended_once(left, clients, deliveries, jobs)
    assert_folder_is_clean(serving.data)
    assert_no_traceback(serving.log)
    return left.values()


def assert_jobs_ended_once(left, clients, deliveries, jobs):
    """``left``  what there is of them, by id."""
    assert left.keys() == set(clients.accepted.values())  # none lost, none taken in twice
    assert len(left) == jobs
    for job in left.values():
        assert job.ends == 1
        assert set(deliveries[job.id]) == {job.delivery}
        if job.state == "succeeded":
            assert job.results >= RESULTS
        else:
            assert (job.state, job.id in clients.cancelled) == ("cancelled", True)
            assert not job.results
    assert len({job.results for job in left.values() if job.results}) == 1


def assert_no_traceback(log):
    # Python's own tracker of semaphores may have something to say when its process is killed.
    assert not re.search(r'File ".*/(service|simplifier)/', log), log


def repeated_attempts(left):
    return sum(job.attempt - 1 for job in left if job.attempt)
