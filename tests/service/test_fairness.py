"""Two tenants at one server, by real HTTP and real workers: neither waits for all of the other."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from service.access.key import Scope
from service.app import create_app
from service.settings import Settings
from service.storage.key_store import SqlKeyStore
from tests.service.light import light_workers
from tests.service.real import BOX
from tests.service.routes.serving import listening, problem
from tests.service.storage.fresh import fresh_database
from tests.waiting import BUSY, until

JOB_SECONDS = 0.4


@pytest.fixture
def serve(tmp_path):
    """``serve(workers=2)``: a server, and a client of each of two tenants."""
    data = tmp_path / "data"
    data.mkdir(mode=0o700)
    database = fresh_database(data / "occluder.db")
    keys = SqlKeyStore(database)
    secrets = {name: keys.create(name, "test", Scope.WRITE)[1] for name in ("studio", "rival")}
    database.close()
    with ExitStack() as opened:

        def start(**chosen):
            settings = Settings(data=data, require_keys=True, dashboard=False, min_free=0, **chosen)
            opened.enter_context(light_workers())
            address = opened.enter_context(listening(create_app(settings)))
            return [
                opened.enter_context(
                    httpx.Client(base_url=address, headers={"X-API-Key": one}, timeout=BUSY)
                )
                for one in secrets.values()
            ]

        yield start


def post(client: httpx.Client, deed: str, number: int, **query: str) -> httpx.Response:
    body = f"# {deed}\n# {number}\n".encode() + BOX
    return client.post("/v1/occluders", params={"filename": "box.obj", **query}, content=body)


def submit(client: httpx.Client, deed: str, number: int, **query: str) -> str:
    answer = post(client, deed, number, **query)
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def ended(client: httpx.Client, job_id: str) -> dict:
    return until(lambda: (job := look(client, job_id))["ended"] and job, BUSY)


def look(client: httpx.Client, job_id: str) -> dict:
    return client.get(f"/v1/jobs/{job_id}").raise_for_status().json()


def test_a_single_job_waits_for_one_of_a_flood(serve) -> None:
    """Also for a client that waits on its connection, whatever the other has sent."""
    studio, rival = serve(workers=1)
    flood = [submit(studio, f"occupy {JOB_SECONDS}", number) for number in range(30)]
    until(lambda: look(studio, flood[0])["state"] != "queued", BUSY)
    begin = time.monotonic()
    answer = rival.post(
        "/v1/occluders", params={"filename": "box.obj", "priority": "bulk"}, content=BOX,
        headers={"Prefer": "wait=30"},
    )  # fmt: skip
    waited = time.monotonic() - begin
    assert answer.status_code == 200, answer.text
    theirs = answer.json()["job"]
    assert theirs["priority"] == "bulk"
    before = [one for one in (look(studio, job) for job in flood) if one["started"]]
    before = [one for one in before if theirs["created"] < one["started"] < theirs["started"]]
    assert len(before) <= 1  # one that may have been begun as it came
    assert waited < 10 * JOB_SECONDS  # of twelve seconds that the flood takes


def test_a_slow_mesh_leaves_a_worker_to_the_others(serve, tmp_path: Path) -> None:
    studio, rival = serve(workers=2)
    gate = tmp_path / "gate"
    slow = [submit(studio, f"wait {gate}", number) for number in range(3)]
    until(lambda: look(studio, slow[0])["state"] == "running", BUSY)
    for number in range(3):
        job = ended(rival, submit(rival, "occupy 0", number))
        assert job["state"] == "succeeded"
    assert [look(studio, job)["state"] for job in slow] == ["running", "queued", "queued"]
    gate.touch()
    assert all(ended(studio, job)["state"] == "succeeded" for job in slow)


def test_within_a_tenant_interactive_jobs_go_first(serve, tmp_path: Path) -> None:
    studio, _ = serve(workers=1)
    gate = tmp_path / "gate"
    first = submit(studio, f"wait {gate}", 0)
    until(lambda: look(studio, first)["state"] == "running", BUSY)  # else it counts as one in a row
    names = {}
    for number, priority in enumerate(["bulk", "bulk", *["interactive"] * 4, ""], 1):
        query = {"priority": priority} if priority else {}
        names[submit(studio, "occupy 0", number, **query)] = priority or "interactive"
    gate.touch()
    jobs = [ended(studio, job) for job in names]
    assert [job["priority"] for job in jobs] == list(names.values())
    order = "".join(job["priority"][0] for job in sorted(jobs, key=lambda job: job["started"]))
    assert order == "iiibiib"


def test_who_sends_too_much_is_told_when_to_come_again(serve) -> None:
    """And may, where that was told; the other tenant has room all along."""
    studio, rival = serve(workers=1, tenant_waiting=3)
    known = ended(studio, submit(studio, f"occupy {2 * JOB_SECONDS}", 0))
    assert known["state"] == "succeeded"
    for number in range(1, 9):
        refused = post(studio, f"occupy {2 * JOB_SECONDS}", number)
        if refused.status_code == 429:
            break
    told = problem(refused, 429, "tenant-queue-full")
    assert "cancel those that are not needed" in told["remedy"]
    seconds = int(refused.headers["retry-after"])
    assert 2 <= seconds <= 6  # three jobs of 0.8 s and what it takes to begin one
    assert submit(rival, "occupy 0", 0)
    time.sleep(seconds)
    assert submit(studio, "occupy 0", 9)
