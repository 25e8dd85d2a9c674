"""Servers and workers that share a database and a bucket, while each is killed, stopped or full."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from functools import partial

import httpx
import pytest

from tests.cluster.machines import LEASE_SECONDS, Cluster
from tests.cluster.ordeal import AWAY, JOBS, Ordeal, box, options
from tests.faults.clients import assert_no_traceback
from tests.faults.serving import TIMEOUT
from tests.faults.small_disk import filled, small_disk
from tests.s3_proxy import error_body
from tests.service.webhooks.receivers import receiving
from tests.waiting import until

ROOM = 64 << 20
OLD = 20
"""Jobs whose files are there to be swept."""


@dataclass
class Scene:
    """What faults are done to.  ``disk`` is that of the last worker's host."""

    cluster: Cluster
    rng: random.Random
    disk: os.PathLike | None = None
    old: list[str] = field(default_factory=list)


def host_is_killed(scene):
    host = scene.rng.choice(scene.cluster.hosts)
    while_all_work(scene)
    host.kill()
    time.sleep(AWAY)
    host.start()


def worker_is_killed(scene):
    while_all_work(scene)
    pids = scene.rng.choice(scene.cluster.hosts).workers
    os.kill(pids[-1], signal.SIGKILL)


def while_all_work(scene):
    """Wait until each host has a job; or for a while, where there are no more."""
    running = "SELECT count(*) FROM jobs WHERE state = 'running'"
    end = time.monotonic() + 20.0
    while time.monotonic() < end:
        if scene.cluster.rows(running) == [(len(scene.cluster.hosts),)]:
            return
        time.sleep(0.05)


def server_is_killed_in_the_midst_of_an_upload(scene):
    place = scene.rng.randrange(len(scene.cluster.servers))
    serving, proxy = scene.cluster.servers[place], scene.cluster.proxies[place]
    seen = len(proxy.seen)

    def endless():
        while True:
            yield bytes(1 << 20)
            time.sleep(0.02)

    def upload():
        with suppress(httpx.TransportError):
            httpx.post(
                f"{serving.address}/v1/occluders?filename=endless.obj", content=endless(),
                timeout=TIMEOUT,
            )  # fmt: skip

    uploading = threading.Thread(target=upload)
    uploading.start()
    until(lambda: any("partNumber" in path for _, path in proxy.seen[seen:]), TIMEOUT)
    serving.kill()
    uploading.join()
    time.sleep(AWAY)
    serving.start()


def leader_is_killed_in_the_midst_of_a_sweep(scene):
    cluster, swept, go_on = scene.cluster, [], threading.Event()

    def held(place):
        def fault(method, path):
            if method == "DELETE":
                swept.append(place)
                go_on.wait(TIMEOUT)

        return fault

    for place in range(len(cluster.servers)):
        cluster.proxies[place].fault = held(place)
    cluster.rows("UPDATE jobs SET ended = 1 WHERE name = 'old.obj'")
    until(lambda: swept, TIMEOUT)
    leader = cluster.servers[swept[0]]
    leader.kill()
    go_on.set()  # what was asked for comes through after who has asked is gone
    for proxy in cluster.proxies:
        proxy.fault = passing
    time.sleep(AWAY)
    leader.start()


def passing(method, path):
    return None


def database_is_killed(scene):
    scene.cluster.postgres.kill()
    time.sleep(AWAY)
    scene.cluster.postgres.start()


def bucket_is_killed(scene):
    scene.cluster.s3.kill()
    time.sleep(AWAY)
    scene.cluster.s3.start()


def host_is_stopped_for_longer_than_its_lease(scene):
    host = scene.rng.choice(scene.cluster.hosts)
    while_all_work(scene)
    host.tell(signal.SIGSTOP)
    time.sleep(3 * LEASE_SECONDS)
    host.tell(signal.SIGCONT)


def bucket_is_busy_for_ten_seconds(scene):
    for proxy in scene.cluster.proxies:
        proxy.fault = lambda method, path: (503, error_body("SlowDown"))
    time.sleep(10.0)
    for proxy in scene.cluster.proxies:
        proxy.fault = passing


def scratch_is_full(scene):
    with filled(scene.disk):
        time.sleep(10.0)


ALL = [
    host_is_killed,
    worker_is_killed,
    server_is_killed_in_the_midst_of_an_upload,
    leader_is_killed_in_the_midst_of_a_sweep,
    database_is_killed,
    bucket_is_killed,
    host_is_stopped_for_longer_than_its_lease,
    bucket_is_busy_for_ten_seconds,
    scratch_is_full,
]
FEW = [worker_is_killed, server_is_killed_in_the_midst_of_an_upload]


def with_disk(parts, tmp_path):
    """A small one for the last host; None where none can be mounted."""
    try:
        return parts.enter_context(small_disk(tmp_path / "disk", ROOM))
    except pytest.skip.Exception as absent:
        print(f"no scratch disk is filled: {absent}")
        return None


@pytest.mark.cluster
@pytest.mark.parametrize(
    ("jobs", "hosts", "faults", "seed"),
    [
        pytest.param(10, 1, FEW, 1, id="short"),
        pytest.param(JOBS, 3, ALL, 2, id="long"),
    ],
)
def test_each_accepted_job_ends_once_whatever_happens(
    cluster, declared, tmp_path, jobs, hosts, faults, seed
):
    rng = random.Random(seed)
    order = rng.sample(faults, len(faults))
    with ExitStack() as parts:
        disk = with_disk(parts, tmp_path) if scratch_is_full in faults else None
        if disk is None:
            order = [one for one in order if one is not scratch_is_full]
        receiver = parts.enter_context(receiving())
        made = cluster(
            work=None, hosts=hosts, last_disk=disk, OCCLUDER_ATTEMPTS="20",
            OCCLUDER_CLEAN_SECONDS="2", OCCLUDER_WEBHOOK_PRIVATE="true", OCCLUDER_MIN_FREE="0",
            OCCLUDER_BLOB_CACHE=str(16 << 20),
        )  # fmt: skip
        parts.callback(made.close)
        scene = Scene(made, rng, disk)
        if leader_is_killed_in_the_midst_of_a_sweep in order:
            put_old_jobs(scene)
        ordeal = Ordeal(made, receiver, parts, jobs, seed)
        ordeal.go_through([partial(fault, scene) for fault in order], rng)
        for host in made.hosts:
            host.stop()
        for serving in made.servers:
            serving.stop()
        for one in (*made.hosts, *made.servers):
            assert_no_traceback(one.log)
    ordeal.compare_and_tell(declared, tmp_path / "alone")


def put_old_jobs(scene):
    for number in range(OLD):
        answer = scene.cluster.post(
            "/v1/occluders?filename=old.obj&" + options(), box(100_000 + number)
        )
        assert answer.status_code == 202, answer.text
    until(
        lambda: scene.cluster.rows("SELECT count(*) FROM jobs WHERE ended IS NOT NULL") == [(OLD,)],
        TIMEOUT,
    )
