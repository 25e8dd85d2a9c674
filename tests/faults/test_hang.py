"""Workers that are stopped, as by ``kill -STOP``: they neither answer nor end."""

from __future__ import annotations

import os
import random
import signal
import time
from contextlib import suppress
from pathlib import Path

import pytest

from tests.waiting import until


def is_stopped(pid):
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"
    return False


@pytest.mark.faults
def test_stopped_workers_are_replaced_and_their_jobs_begun_again(server):
    rng, stopped = random.Random(7), []
    serving = server(OCCLUDER_WORKERS="2", OCCLUDER_LEASE_SECONDS="2").start()
    jobs = [serving.submit(f"# occupy 0.5\n# {number}") for number in range(30)]
    begin = time.monotonic()
    for _ in range(4):
        until(lambda: serving.get("/v1/jobs?state=running&limit=1").json()["items"])
        time.sleep(rng.uniform(0.0, 0.1))
        for pid in serving.workers:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGSTOP)
                stopped.append(pid)
        until(lambda: not any(map(is_stopped, stopped)))
    ended = [serving.end_of(one) for one in jobs]
    took = time.monotonic() - begin
    assert {job["state"] for job in ended} == {"succeeded"}
    again = sum(job["attempt"] > 1 for job in ended)
    assert 1 <= again <= len(stopped)
    assert serving.is_ready()
    serving.assert_served_whole(serving.end_of(serving.submit("# after"))["id"])
    assert "Traceback" not in serving.log
    print(f"{len(jobs)} jobs, {len(stopped)} stops, {again} jobs begun again, {took:.0f} s")
