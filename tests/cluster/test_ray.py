"""Jobs done by the nodes of a real Ray cluster, which dispatch offers them to."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from tests.acceptance.command import occluder
from tests.cluster.machines import NEEDS_RAY, Cluster, children_of
from tests.cluster.ray_nodes import Dispatch, RayNodes
from tests.cluster.remains import jobs_left
from tests.faults.serving import LIGHT_WORK
from tests.service.real import BOX
from tests.waiting import BUSY, until

pytestmark = [pytest.mark.cluster, NEEDS_RAY]

LONG_LEASE = 60
"""Seconds: what is over before was not brought about by a lease that ran out."""


@pytest.fixture(scope="module")
def farm(declared, tmp_path_factory):
    """One server, no worker, two nodes, and a dispatcher."""
    folder = tmp_path_factory.mktemp("farm")
    cluster = Cluster(
        declared, folder, hosts=0, servers=1, engine="ray", FAULTS_WORK=str(LIGHT_WORK),
        OCCLUDER_LEASE_SECONDS=str(LONG_LEASE),
    )  # fmt: skip
    try:
        cluster.ray = RayNodes(declared, cluster.shared)
        cluster.dispatch = dispatch_to(cluster, declared, folder / "dispatch.log").start()
        yield cluster
    finally:
        if hasattr(cluster, "dispatch"):
            cluster.dispatch.kill()
        if hasattr(cluster, "ray"):
            cluster.ray.close()
        cluster.close()


def dispatch_to(cluster, declared, log):
    return Dispatch(declared, log, cluster.shared | cluster.ray.joining)


def submit(farm, first_line="#"):
    body = f"{first_line}\n# {time.monotonic_ns()}\n".encode() + BOX
    answer = farm.post("/v1/occluders?filename=box.obj", body)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def states(farm, ids):
    left = jobs_left(farm)
    return [left[one].state for one in ids]


def all_succeed(farm, ids, seconds=BUSY):
    until(lambda: states(farm, ids) == ["succeeded"] * len(ids), seconds)


def is_running(farm, job_id):
    return states(farm, [job_id]) == ["running"]


def node_of(farm, job_id):
    """The one whose process has the job's scratch folder."""
    found = [
        node for node in farm.ray.nodes
        if list(node.data.glob(f"ray-*/scratch/{job_id}-*"))
    ]  # fmt: skip
    return found[0] if found else None


def on_second_node(farm, gate):
    """A job that waits for the gate on the node without the head."""
    second = farm.ray.nodes[1]
    ids = [submit(farm, f"# wait {gate}") for _ in range(2)]  # a node each
    until(lambda: all(is_running(farm, one) and node_of(farm, one) for one in ids), BUSY)
    (job_id,) = [one for one in ids if node_of(farm, one) is second]
    return job_id, ids


def test_jobs_are_done_by_both_nodes_and_their_ends_are_recorded(farm, tmp_path):
    gate = tmp_path / "gate"
    _, ids = on_second_node(farm, gate)
    ids += [submit(farm) for _ in range(10)]
    gate.touch()
    all_succeed(farm, ids)
    assert all(job.attempt == 1 for job in jobs_left(farm).values())


def test_secrets_stay_where_they_are_needed(farm, tmp_path):
    """Neither Ray's processes beside the task nor the confined one are told by the dispatcher."""
    gate = tmp_path / "gate"
    _, ids = on_second_node(farm, gate)
    password = farm.address.rpartition("/")[2].encode()
    for node in farm.ray.nodes:
        (task,) = node.tasks()
        assert password in Path(f"/proc/{task}/environ").read_bytes()
        for confined in children_of(task):
            told = Path(f"/proc/{confined}/environ").read_bytes()
            assert password not in told
            assert b"RAY_AUTH" not in told
            assert b"AWS_" not in told
    gate.touch()
    all_succeed(farm, ids)


def test_a_running_job_is_cancelled_at_once_and_its_place_is_free(farm, tmp_path):
    _, ids = on_second_node(farm, tmp_path / "never")
    for one in ids:
        assert farm.post(f"/v1/jobs/{one}/cancel").status_code == 200
    began = time.monotonic()
    until(lambda: states(farm, ids) == ["cancelled"] * 2, BUSY)
    assert time.monotonic() - began < 10.0
    all_succeed(farm, [submit(farm)])


def test_a_job_whose_process_dies_is_tried_as_often_as_elsewhere(farm):
    job_id = submit(farm, "# die")
    until(lambda: states(farm, [job_id]) == ["failed"], BUSY)
    assert jobs_left(farm)[job_id].attempt == 3


@pytest.mark.parametrize("loss", ["node", "raylet", "task"])
def test_what_was_lost_is_done_again_long_before_its_lease_ends(farm, tmp_path, loss):
    gate = tmp_path / "gate"
    job_id, ids = on_second_node(farm, gate)
    second = farm.ray.nodes[1]
    began = time.monotonic()
    if loss == "node":
        second.kill()
    elif loss == "raylet":
        second.kill_raylet()
    else:
        os.kill(second.tasks()[0], signal.SIGKILL)
    until(lambda: not is_running(farm, job_id), LONG_LEASE / 2)
    print(f"{loss} killed: taken back after {time.monotonic() - began:.2f} s")
    gate.touch()
    all_succeed(farm, ids, LONG_LEASE / 2)
    left = jobs_left(farm)
    assert left[job_id].attempt == 2
    if loss != "task":
        second.start()


def test_a_dispatcher_that_ends_gives_its_jobs_back_and_the_next_one_offers_them(farm, tmp_path):
    gate = tmp_path / "gate"
    _, ids = on_second_node(farm, gate)
    assert farm.dispatch.stop() == 0
    assert states(farm, ids) == ["queued"] * 2
    assert (
        farm.rows(f"SELECT attempts - attempt FROM jobs WHERE id IN ('{ids[0]}', '{ids[1]}')")
        == [(3,)] * 2
    )
    gate.touch()
    farm.dispatch.start()
    all_succeed(farm, ids)


def test_a_second_dispatcher_waits_until_the_first_is_gone(farm, declared, tmp_path):
    second = dispatch_to(farm, declared, tmp_path / "second.log").start()
    try:
        all_succeed(farm, [submit(farm)])
        assert "it offers jobs to Ray" not in second.log
        farm.dispatch.kill()
        until(lambda: "it offers jobs to Ray" in second.log, BUSY)
        all_succeed(farm, [submit(farm)])
    finally:
        assert second.stop() == 0
        farm.dispatch.start()


def test_a_node_of_another_release_gets_no_work(farm, tmp_path):
    other = tmp_path / "version.py"
    other.write_text('VERSION = "99.0"\n')
    second = farm.ray.nodes[1]
    second.kill()
    second.start(FAULTS_RELEASE=str(other), OCCLUDER_DATA=str(tmp_path / "data"))
    until(lambda: "gets no work: it runs release 99.0" in farm.dispatch.log, BUSY)
    ids = [submit(farm, "# occupy 0.3") for _ in range(4)]
    all_succeed(farm, ids)
    assert not (tmp_path / "data").exists()  # no task has begun there
    second.kill()
    second.start()
    _, ids = on_second_node(farm, tmp_path / "gate")
    (tmp_path / "gate").touch()
    all_succeed(farm, ids)


class TestWhatIsSetUpWrongly:
    """One line, and status 2."""

    def refused(self, farm, **changes):
        done = occluder("dispatch", **farm.shared | farm.ray.joining | changes)
        assert done.returncode == 2, done.stderr
        (line,) = done.stderr.splitlines()
        assert line.startswith("error: ")
        return line

    def test_ray_beyond_this_machine_without_a_token(self, farm):
        line = self.refused(
            farm, RAY_ADDRESS="192.0.2.1:6379", RAY_AUTH_MODE=None, RAY_AUTH_TOKEN_PATH=None
        )
        assert "without a token" in line

    def test_a_wrong_token(self, farm, tmp_path):
        wrong = tmp_path / "token"
        wrong.write_text("0" * 48)
        assert "does not take the token" in self.refused(farm, RAY_AUTH_TOKEN_PATH=str(wrong))

    def test_no_token_where_one_is_asked_for(self, farm):
        line = self.refused(farm, RAY_AUTH_MODE="disabled", RAY_AUTH_TOKEN_PATH=None)
        assert "does not take the token" in line

    def test_nobody_at_the_address(self, farm):
        assert "nobody answers at" in self.refused(farm, RAY_ADDRESS="127.0.0.1:1")

    def test_no_shared_database(self, farm):
        assert "OCCLUDER_DATABASE_URL" in self.refused(farm, OCCLUDER_DATABASE_URL=None)

    @pytest.mark.parametrize(
        ("variable", "told"),
        [("TESTS_RAY_VERSION", "is 2.1.0 on"), ("TESTS_PYTHON_VERSION", "on Python 3.8.1")],
    )
    def test_another_version_of_ray_or_python(self, farm, declared, variable, told):
        versions = {"TESTS_RAY_VERSION": "2.1.0", "TESTS_PYTHON_VERSION": "3.8.1"}
        other = RayNodes(declared, {variable: versions[variable]}, more=0)
        try:
            line = self.refused(farm, **other.joining)
        finally:
            other.close()
        assert told in line
        assert "same versions" in line
