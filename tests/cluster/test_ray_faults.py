"""Servers, a worker and a Ray cluster that do jobs together, while each part is killed once."""

from __future__ import annotations

import os
import random
import signal
import time
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial

import pytest

from tests.cluster.machines import NEEDS_RAY, Cluster
from tests.cluster.ordeal import AWAY, JOBS, Ordeal
from tests.cluster.ray_nodes import Dispatch, RayNodes
from tests.faults.clients import assert_no_traceback
from tests.service.webhooks.receivers import receiving


@dataclass
class Scene:
    """What faults are done to."""

    cluster: Cluster
    ray: RayNodes
    dispatch: Dispatch
    rng: random.Random


def while_nodes_work(scene):
    """Wait until there is a job on each node; or for a while, where there are no more."""
    running = "SELECT count(*) FROM jobs WHERE state = 'running' AND owner LIKE 'ray-%'"
    end = time.monotonic() + 20.0
    while time.monotonic() < end:
        if scene.cluster.rows(running) == [(len(scene.ray.nodes),)]:
            return
        time.sleep(0.02)


def raylet_is_killed_alone(scene):
    node = scene.ray.nodes[1]
    while_nodes_work(scene)
    node.kill_raylet()
    time.sleep(AWAY)
    node.start()


def node_is_killed(scene):
    node = scene.ray.nodes[1]
    while_nodes_work(scene)
    node.kill()
    time.sleep(AWAY)
    node.start()


def task_is_killed(scene):
    while_nodes_work(scene)
    tasks = [pid for node in scene.ray.nodes for pid in node.tasks()]
    os.kill(scene.rng.choice(tasks), signal.SIGKILL)


def dispatch_is_killed(scene):
    while_nodes_work(scene)
    scene.dispatch.kill()
    time.sleep(AWAY)
    scene.dispatch.start()


def head_is_killed(scene):
    """What the other node did under the old head ends with it; whoever keeps it starts it anew."""
    head, other = scene.ray.nodes
    while_nodes_work(scene)
    head.kill()
    time.sleep(AWAY)
    head.start()
    other.wait_for_its_end()
    other.start()


def server_is_killed(scene):
    serving = scene.rng.choice(scene.cluster.servers)
    serving.kill()
    time.sleep(AWAY)
    serving.start()


def database_is_killed(scene):
    scene.cluster.postgres.kill()
    time.sleep(AWAY)
    scene.cluster.postgres.start()


ALL = [
    raylet_is_killed_alone, node_is_killed, task_is_killed, dispatch_is_killed, head_is_killed,
    server_is_killed, database_is_killed,
]  # fmt: skip


@pytest.mark.cluster
@NEEDS_RAY
@pytest.mark.parametrize(
    ("jobs", "faults", "seed"),
    [
        pytest.param(20, [node_is_killed, dispatch_is_killed], 3, id="short"),
        pytest.param(JOBS, ALL, 4, id="long"),
    ],
)
def test_each_accepted_job_ends_once_whatever_happens_to_ray(
    declared, tmp_path, jobs, faults, seed
):
    rng = random.Random(seed)
    with ExitStack() as parts:
        receiver = parts.enter_context(receiving())
        cluster = Cluster(
            declared, tmp_path, hosts=1, engine="ray", OCCLUDER_ATTEMPTS="20",
            OCCLUDER_CLEAN_SECONDS="2", OCCLUDER_WEBHOOK_PRIVATE="true", OCCLUDER_MIN_FREE="0",
            OCCLUDER_BLOB_CACHE=str(16 << 20), OCCLUDER_JOB_MEMORY=str(512 << 20),
        )  # fmt: skip
        parts.callback(cluster.close)
        ray = RayNodes(declared, cluster.shared)
        parts.callback(ray.close)
        dispatch = Dispatch(declared, tmp_path / "dispatch.log", cluster.shared | ray.joining)
        parts.callback(dispatch.kill)
        scene = Scene(cluster, ray, dispatch.start(), rng)
        ordeal = Ordeal(cluster, receiver, parts, jobs, seed)
        order = rng.sample(faults, len(faults))
        ordeal.go_through([partial(fault, scene) for fault in order], rng)
        assert dispatch.stop() == 0
        for host in cluster.hosts:
            host.stop()
        for serving in cluster.servers:
            serving.stop()
        for one in (dispatch, *cluster.hosts, *cluster.servers):
            assert_no_traceback(one.log)
    ordeal.compare_and_tell(declared, tmp_path / "alone")
