"""Two servers and a worker that share a database and a bucket, as their clients see them."""

from __future__ import annotations

import os

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from service.access.attempts import LIMIT
from service.access.key import new_secret
from tests.acceptance.command import occluder
from tests.cluster.machines import Cluster
from tests.faults.serving import LIGHT_WORK
from tests.service.real import BOX
from tests.waiting import BUSY, until


@pytest.fixture(scope="module")
def pair(declared, tmp_path_factory):
    """With ``key``, made before there was a server."""

    def prepare(address):
        nonlocal key
        done = occluder(
            "keys", "create", "--name", "pipeline", "--scope", "write",
            PYTHONPATH=declared, OCCLUDER_DATABASE_URL=address,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        key = done.stdout.split()[-1]

    key = ""
    made = Cluster(
        declared, tmp_path_factory.mktemp("pair"), hosts=1, prepare=prepare,
        FAULTS_WORK=str(LIGHT_WORK), OCCLUDER_REQUIRE_KEYS="true",
    )  # fmt: skip
    made.key = key
    yield made
    made.close()


@pytest.fixture
def clients(pair):
    """Of each server one."""
    made = [
        httpx.Client(base_url=one.address, headers={"X-API-Key": pair.key}, timeout=BUSY)
        for one in pair.servers
    ]
    yield made
    for one in made:
        one.close()


def test_a_job_of_one_is_followed_and_fetched_at_the_other(clients):
    first, second = clients
    answer = first.post("/v1/occluders?filename=box.obj", content=b"# followed\n" + BOX)
    assert answer.status_code == 202
    place = answer.headers["location"]
    with second.stream("GET", f"{place}/events") as events:
        told = "".join(events.iter_text())
    assert "event: succeeded" in told or '"state":"succeeded"' in told.replace(" ", "")
    file = second.get(f"{place}/files/lod0.obj")
    assert file.content == b"# followed\n" + BOX
    assert first.get(f"{place}/files/lod0.obj").content == file.content


def test_a_request_that_is_sent_again_to_the_other_makes_no_second_job(clients):
    first, second = clients
    again = {"Idempotency-Key": "night-7"}
    places = {
        one.post("/v1/occluders?filename=box.obj", content=BOX, headers=again).headers["location"]
        for one in (first, second, first)
    }
    assert len(places) == 1


def test_a_job_is_cancelled_at_the_other(clients, tmp_path):
    first, second = clients
    never = f"# wait {tmp_path / 'never'}\n".encode()
    place = first.post("/v1/occluders?filename=box.obj", content=never + BOX).headers["location"]
    until(lambda: first.get(place).json()["state"] == "running", BUSY)
    assert second.post(f"{place}/cancel").status_code == 200
    until(lambda: first.get(place).json()["state"] == "cancelled", BUSY)


def test_each_tells_the_counts_of_all(clients):
    def ended(client):
        families = text_string_to_metric_families(client.get("/metrics").text)
        return {
            (sample.name, *sorted(sample.labels.items())): sample.value
            for family in families if family.name == "occluder_jobs" for sample in family.samples
        }  # fmt: skip

    first, second = clients
    until(lambda: ended(first) == ended(second), BUSY)
    assert sum(ended(first).values()) >= 3.0


def test_wrong_keys_count_at_all_of_them(pair):
    """Each by itself would bear twice as many; failures fade, so it may take some more."""
    with httpx.Client() as client:
        for number in range(2 * LIMIT - 5):
            address = pair.servers[number % 2].address
            answer = client.get(f"{address}/v1/jobs", headers={"X-API-Key": new_secret()})
            if answer.status_code == 429:
                return
            assert answer.status_code == 401
    pytest.fail("wrong keys count at each server by itself")


def test_a_key_that_is_revoked_is_refused_by_both(pair, clients, declared, here, monkeypatch):
    """By the command, as an operator gives it on whichever machine."""
    for folder in reversed(declared.split(os.pathsep)):
        monkeypatch.syspath_prepend(folder)
    monkeypatch.setenv("OCCLUDER_DATABASE_URL", pair.address)
    told = here("keys", "list")
    assert told.returncode == 0, told.stderr
    (line,) = [one for one in told.stdout.splitlines() if "pipeline" in one]
    assert here("keys", "revoke", line.split()[0]).returncode == 0
    for client in clients:
        until(lambda: client.get("/v1/jobs").status_code in (401, 429), BUSY)  # noqa: B023
