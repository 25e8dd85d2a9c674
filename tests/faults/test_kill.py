"""``kill -9`` of workers and of the server at any moment, while clients post and try again."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress

import pytest

from tests.faults.clients import (
    PATIENCE,
    Clients,
    assert_each_ended_once,
    repeated_attempts,
    stop_cleanly,
)
from tests.faults.serving import LIGHT_WORK
from tests.service.webhooks.receivers import receiving
from tests.waiting import until

WORKERS = 2
STORM = 40
"""Kills of a storm."""


@pytest.mark.parametrize(
    ("jobs", "kills", "work", "seed"),
    [
        pytest.param(11, 3, LIGHT_WORK, 6, id="short"),
        pytest.param(200, 30, None, 2, id="long", marks=pytest.mark.faults),
    ],
)
def test_each_accepted_job_ends_once_whatever_is_killed(server, tmp_path, jobs, kills, work, seed):
    rng = random.Random(seed)
    victims = ["server", "worker", *rng.choices(["server", "worker"], k=kills - 2)]
    moments = sorted(rng.uniform(0, jobs * 0.9) for _ in victims)  # by jobs that have ended
    begin = time.monotonic()
    with receiving() as receiver:
        serving = server(
            work=work, OCCLUDER_WORKERS=str(WORKERS), OCCLUDER_ATTEMPTS="20",
            OCCLUDER_WEBHOOK_PRIVATE="true",
        ).start()  # fmt: skip
        clients = Clients(serving, receiver, jobs, seed)
        with ThreadPoolExecutor(1) as pool, ExitStack() as at_end:
            at_end.callback(clients.unwanted.set)
            posting = pool.submit(clients.run)
            for moment, victim in zip(moments, victims, strict=True):
                until(lambda: len(clients.deliveries()) >= moment or posting.done(), PATIENCE)  # noqa: B023
                time.sleep(rng.uniform(0.0, 0.5))  # anywhere in a job
                if victim == "server":
                    serving.kill()
                    serving.start()
                elif pids := serving.workers:
                    with suppress(ProcessLookupError):
                        os.kill(rng.choice(pids), signal.SIGKILL)
            posting.result()
        until(lambda: len(clients.deliveries()) == jobs, PATIENCE)
        until(lambda: all(job["ended"] for job in serving.jobs()), PATIENCE)
        deliveries = clients.deliveries()
        stop_cleanly(serving)

    left = assert_each_ended_once(serving, clients, deliveries, jobs)
    repeated = repeated_attempts(left)
    most = sum(WORKERS if victim == "server" else 1 for victim in victims)
    assert repeated <= most
    states = [job.state for job in left]
    print(
        f"{jobs} jobs, {victims.count('server')} kills of the server and "
        f"{victims.count('worker')} of workers in {time.monotonic() - begin:.0f} s: "
        f"{states.count('succeeded')} succeeded, {states.count('cancelled')} cancelled, "
        f"{repeated} attempts repeated, {clients.lost} requests sent again, "
        f"{sum(map(len, deliveries.values())) - jobs} webhooks heard twice"
    )


def runs(serving):
    """Whether some job is under way."""
    return bool(serving.get("/v1/jobs?state=running&limit=1").json()["items"])


@pytest.mark.faults
def test_jobs_end_while_workers_and_the_server_are_killed_all_the_time(server):
    """Over the whole length of the posting, and each while a job runs."""
    rng, jobs, killed = random.Random(5), 200, {"server": 0, "worker": 0}
    moments = [jobs * 0.95 * (number + 1) / STORM for number in range(STORM)]  # by jobs ended
    begin = time.monotonic()
    with receiving() as receiver:
        serving = server(
            OCCLUDER_WORKERS=str(WORKERS), OCCLUDER_ATTEMPTS="20", OCCLUDER_WEBHOOK_PRIVATE="true"
        ).start()
        clients = Clients(serving, receiver, jobs, 5)
        with ThreadPoolExecutor(1) as pool, ExitStack() as at_end:
            at_end.callback(clients.unwanted.set)
            posting = pool.submit(clients.run)
            for number, moment in enumerate(moments):
                until(lambda: len(clients.deliveries()) >= moment or posting.done(), PATIENCE)  # noqa: B023
                until(lambda: runs(serving) or posting.done(), PATIENCE)
                time.sleep(rng.uniform(0.0, 0.1))
                if number % 10 == 9:
                    serving.kill()
                    serving.start()
                    killed["server"] += 1
                elif pids := serving.workers:
                    with suppress(ProcessLookupError):
                        os.kill(rng.choice(pids), signal.SIGKILL)
                        killed["worker"] += 1
            posting.result()
        until(lambda: len(clients.deliveries()) == jobs, PATIENCE)
        deliveries = clients.deliveries()
        stop_cleanly(serving)
    left = assert_each_ended_once(serving, clients, deliveries, jobs)
    again = [job for job in left if job.attempt > 1]
    assert again
    assert len(again) >= STORM // 4  # of two workers one is hit, which may be between jobs
    print(
        f"{jobs} jobs in {time.monotonic() - begin:.0f} s, {killed['server']} kills of the server "
        f"and {killed['worker']} of workers: {len(again)} jobs begun more than once, "
        f"{max(job.attempt for job in left)} times at most, {repeated_attempts(left)} attempts "
        f"repeated, {clients.lost} requests sent again"
    )


@pytest.mark.faults
def test_a_sweep_goes_on_where_the_server_was_killed(server):
    """Runs that were measured before the kill are not measured again."""
    serving = server(work=None, OCCLUDER_WORKERS="1").start()
    made = serving.post("/v1/occluders?filename=box.obj&asset=box&preset=draft&views=8")
    assert serving.end_of(made.json()["id"])["state"] == "succeeded"
    asset = serving.get(f"/v1/jobs/{made.json()['id']}").json()["asset"]["id"]
    sweep = serving.post(
        f"/v1/assets/{asset}/tradeoff",
        b'{"budgets": [8], "resolutions": [16], "directions": [8], "times": [1], "repeats": 1}',
        {"Content-Type": "application/json"},
    )
    assert sweep.status_code == 202, sweep.text
    journals = serving.data / "journals"
    until(lambda: any(one.read_text().count("\n") > 3 for one in journals.glob("*")), PATIENCE)
    before = next(journals.glob("*")).read_text().splitlines()
    serving.kill()
    serving.start()
    assert serving.end_of(sweep.json()["id"], PATIENCE)["state"] == "succeeded"
    assert list(journals.glob("*")) == []
    table = serving.get(f"/v1/jobs/{sweep.json()['id']}/files/tradeoff.csv").text
    kept = [json.loads(line) for line in before[1:-1]]
    assert len(kept) >= 2
    assert all(f"{line['seconds']:.6g}"[:5] in table for line in kept)
