"""Jobs that clients post while faults happen, and what has to be left when all have ended."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise

from tests.cluster.machines import LEASE_SECONDS
from tests.cluster.remains import (
    assert_objects_are_whole,
    astray,
    files_by_input,
    files_by_input_alone,
    jobs_left,
)
from tests.faults.clients import (
    PATIENCE,
    Clients,
    assert_jobs_ended_once,
    repeated_attempts,
)
from tests.faults.serving import TIMEOUT, Server
from tests.service.real import BOX, QUICK
from tests.waiting import until

JOBS = int(os.environ.get("CLUSTER_JOBS", "500"))
"""That clients post where all faults happen."""
AWAY = 3.0
"""Seconds for which what was killed is away."""


def box(number):
    """A mesh of its own."""
    sides = [1.0 + 0.002 * number, 1.0 + 0.003 * (number % 7), 1.0]
    lines = []
    for line in BOX.decode().splitlines():
        kind, *values = line.split()
        if kind == "v":
            values = [f"{float(one) * side:.3f}" for one, side in zip(values, sides, strict=True)]
        lines.append(" ".join([kind, *values]))
    return ("\n".join(lines) + f"\n# {number}\n").encode()


@dataclass(frozen=True)
class Fault:
    """``began``, ``over``  Unix seconds.  ``hit``  the jobs that were under way as it began."""

    name: str
    began: float
    over: float
    hit: list[str]


class Ordeal:
    """So many jobs of clients at a cluster, under faults that begin as they end."""

    def __init__(self, cluster, receiver, parts, jobs, seed):
        """``parts``  what is left by when the test ends, however it does."""
        self._cluster, self._jobs = cluster, jobs
        self._clients = Clients(cluster, receiver, jobs, seed, box)
        self._pool = parts.enter_context(ThreadPoolExecutor(1))
        parts.callback(self._clients.unwanted.set)
        self._happened = []

    def go_through(self, faults, rng):
        """Have each happen once, and see that all jobs have ended once, and the files are whole."""
        cluster, clients, jobs = self._cluster, self._clients, self._jobs
        moments = sorted(rng.uniform(0.02, 0.9) * jobs for _ in faults)  # by jobs that have ended
        begin = time.monotonic()
        posting = self._pool.submit(clients.run)
        for moment, fault in zip(moments, faults, strict=True):
            until(lambda: len(clients.deliveries()) >= moment or posting.done(), PATIENCE)  # noqa: B023
            time.sleep(rng.uniform(0.0, 0.5))  # anywhere in a job
            hit = [one for (one,) in cluster.rows("SELECT id FROM jobs WHERE state = 'running'")]
            began = time.time()
            fault()
            self._happened.append(Fault(fault.func.__name__, began, time.time(), hit))
        posting.result()
        until(lambda: len(clients.deliveries()) == jobs, PATIENCE)
        self._seconds = time.monotonic() - begin
        # What a killed one had begun is kept for ten times as long as its lease.
        with suppress(AssertionError):
            until(lambda: not astray(cluster), 10 * LEASE_SECONDS + TIMEOUT)
        assert not astray(cluster)
        self._left = jobs_left(cluster)
        assert_jobs_ended_once(self._left, clients, clients.deliveries(), jobs)
        assert_objects_are_whole(cluster)
        self._ended = dict(cluster.rows("SELECT id, ended FROM jobs"))
        self._files = files_by_input(cluster)

    def compare_and_tell(self, declared, data):
        """The files are those of one server alone; then the figures of ``docs/scale.md``."""
        numbers = sorted(self._clients.accepted)
        assert self._files == files_alone(declared, data, numbers, self._files)
        tell(self._jobs, self._seconds, self._left.values(), self._ended, self._happened)


def options():
    return "&".join(f"{name}={value}" for name, value in QUICK.items())


def files_alone(declared, data, numbers, wanted):
    """What one server with a database of its own makes of the meshes of which files are wanted."""
    serving = Server(
        declared,
        data,
        OCCLUDER_DASHBOARD="false",
        OCCLUDER_WORKERS="2",
        OCCLUDER_QUEUE_LIMIT="5000",
    ).start()
    try:
        for number in numbers:
            answer = serving.post(f"/v1/occluders?filename=box.obj&{options()}", box(number))
            assert answer.status_code == 202, answer.text
        until(lambda: all(job["ended"] for job in serving.jobs()), PATIENCE)
        serving.stop()
    finally:
        serving.kill()
    made = files_by_input_alone(data)
    return {mesh: files for mesh, files in made.items() if mesh in wanted}


def tell(jobs, seconds, left, ended, happened):
    """The figures of ``docs/scale.md``."""
    states = [job.state for job in left]
    print(
        f"{jobs} jobs in {seconds:.0f} s: {states.count('succeeded')} succeeded, "
        f"{states.count('cancelled')} cancelled, {repeated_attempts(left)} attempts repeated"
    )
    ends = sorted(ended.values())
    for one in happened:
        near = [end for end in ends if one.began - 5.0 <= end <= one.over + 15.0]
        pause = max((after - before for before, after in pairwise(near)), default=0.0)
        waited = max((ended[job] - one.began for job in one.hit if job in ended), default=0.0)
        print(
            f"{one.name.replace('_', ' ')}, {one.over - one.began:.1f} s: no job ended for "
            f"{pause:.1f} s, those under way had ended after {waited:.1f} s"
        )
