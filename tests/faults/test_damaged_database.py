"""A database that is damaged or gone: told at once, and never shown as empty or in part."""

from __future__ import annotations

import random
import shutil

import pytest

from tests.waiting import until

PAGE = 4096


def filled(server, jobs=40, **variables):
    """A server that has done some jobs and was stopped, so that all is in the one file."""
    serving = server(**variables).start()
    ids = [serving.submit(f"# {number}") for number in range(jobs)]
    for job_id in ids:
        serving.end_of(job_id)
    serving.stop()
    return serving, ids


def spoil(serving, pages, seed=1):
    """Write noise over pages, counted from 0."""
    noise = random.Random(seed)
    with (serving.data / "occluder.db").open("r+b") as file:
        for page in pages:
            file.seek(page * PAGE)
            file.write(noise.randbytes(PAGE))


def pages_of(serving):
    return (serving.data / "occluder.db").stat().st_size // PAGE


def assert_refuses_to_start(serving, said):
    status, error = serving.refused()
    assert status == 1
    assert said in error
    assert "backup" in error
    assert len(error.splitlines()) == 1


def assert_told(answer):
    assert answer.status_code == 500, answer.text
    assert answer.json()["type"] == "/problems/database-damaged"
    assert "backup" in answer.json()["remedy"]


@pytest.mark.faults
def test_damage_while_it_runs_is_told_until_a_backup_is_back(server):
    serving, ids = filled(server, jobs=8, OCCLUDER_CLEAN_SECONDS="0.2")
    backup = shutil.copy(serving.data / "occluder.db", serving.data.with_suffix(".backup"))
    serving.start()
    assert len(serving.jobs()) == len(ids)
    spoil(serving, range(1, pages_of(serving)))

    def told():
        """Pages that were read before the damage are as good as ever."""
        answer = serving.get("/v1/jobs")
        assert answer.status_code == 500 or len(answer.json()["items"]) == len(ids)
        return answer.status_code == 500 and answer

    assert_told(until(told))
    ready = serving.get("/readyz")
    assert ready.status_code == 503
    assert "database" in ready.json()["detail"]
    assert serving.get("/healthz").status_code == 200
    for path in ("/v1/jobs?state=queued", "/v1/assets", f"/v1/jobs/{ids[0]}/files", "/metrics"):
        assert_told(serving.get(path))
    assert_told(serving.post())
    assert "Traceback" not in serving.log
    serving.stop()

    assert_refuses_to_start(serving, "is damaged")
    for beside in ("-wal", "-shm"):
        (serving.data / f"occluder.db{beside}").unlink(missing_ok=True)
    shutil.copy(backup, serving.data / "occluder.db")
    serving.start()
    assert [job["id"] for job in serving.jobs()] == ids[::-1]
    for job_id in ids:  # and nothing was swept away meanwhile
        serving.assert_served_whole(job_id)


@pytest.mark.faults
def test_a_lost_database_is_not_replaced_by_an_empty_one(server):
    serving, _ = filled(server, jobs=1)
    blobs = {path.name for path in (serving.data / "blobs").glob("??/*")}
    (serving.data / "occluder.db").unlink()
    assert_refuses_to_start(serving, "is gone")
    assert {path.name for path in (serving.data / "blobs").glob("??/*")} == blobs


@pytest.mark.faults
def test_any_damaged_page_is_told_or_was_not_in_use(server):
    serving, ids = filled(server)
    database = serving.data / "occluder.db"
    sound = database.read_bytes()
    unused = 0
    for page in range(pages_of(serving)):
        database.write_bytes(sound)
        spoil(serving, [page], seed=page)
        try:
            serving.start()
        except AssertionError:
            assert "is damaged" in serving.log.splitlines()[-1]
        else:
            assert [job["id"] for job in serving.jobs()] == ids[::-1]
            unused += 1
            serving.kill()
    print(f"{len(sound) // PAGE} pages, each damaged once: {unused} not in use, the others told of")
