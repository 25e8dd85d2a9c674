"""A disk that fills up: refused, waited for, and gone on with; nothing is half written."""

from __future__ import annotations

import os
import random
import signal

import pytest

from tests.faults.remains import assert_folder_is_clean, jobs_left
from tests.faults.small_disk import filled, small_disk
from tests.service.real import BOX
from tests.waiting import until

ROOM = 24 << 20
LARGE = b"# " + random.Random(1).randbytes(1 << 19).hex().encode() + b"\n" + BOX


@pytest.fixture
def disk(tmp_path):
    with small_disk(tmp_path / "disk", ROOM) as place:
        yield place


def assert_refused(answer):
    assert answer.status_code == 507, answer.text
    assert answer.json()["type"] == "/problems/disk-full"
    assert answer.json()["remedy"]


@pytest.mark.faults
def test_a_full_disk_refuses_uploads_and_holds_up_jobs_until_there_is_room(disk, server, tmp_path):
    gate = tmp_path / "gate"
    serving = server(data=disk / "data", OCCLUDER_WORKERS="1", OCCLUDER_MIN_FREE="0").start()
    done = serving.submit("# fill 300000")
    serving.end_of(done)
    under_way = serving.submit(f"# wait {gate}")
    until(lambda: serving.job(under_way)["state"] == "running")
    waiting = [serving.submit(f"# {number}") for number in range(3)]
    with filled(disk):
        assert_refused(serving.post(body=LARGE))
        assert_refused(serving.post(body=iter([LARGE[:70_000], LARGE[70_000:]])))
        gate.touch()  # the job under way ends now, and cannot say so
        until(lambda: not serving.is_ready())
        assert "disk" in serving.get("/readyz").json()["detail"]
        assert_refused(serving.post(f"/v1/jobs/{waiting[-1]}/cancel", b""))
        serving.assert_served_whole(done)
        assert len(serving.jobs()) == 5
        assert serving.job(waiting[0])["state"] == "queued"
    for job_id in (under_way, *waiting):
        job = serving.end_of(job_id)
        assert job["state"] == "succeeded" or job["failure"]["kind"] == "disk-full", job
    until(serving.is_ready)
    serving.assert_served_whole(serving.end_of(serving.submit("# after"))["id"])
    serving.stop()
    serving.start()  # which cleans
    until(lambda: serving.log.count("cleaning freed") == 2)
    serving.stop()
    assert_folder_is_clean(serving.data)
    assert "Traceback" not in serving.log
    assert len(jobs_left(serving.data)) == 6


@pytest.mark.faults
def test_what_is_to_stay_free_is_not_taken(server):
    """On whatever disk: this needs no small one."""
    serving = server().start(OCCLUDER_MIN_FREE="0")
    done = serving.submit()
    serving.end_of(done)
    serving.stop()
    serving.start(OCCLUDER_MIN_FREE=str(1 << 60))
    assert_refused(serving.post(body=LARGE))
    assert not serving.is_ready()
    serving.assert_served_whole(done)


@pytest.mark.faults
def test_a_server_that_finds_no_room_says_so_and_starts_once_there_is(disk, server):
    serving = server(data=disk / "data", OCCLUDER_MIN_FREE="0").start()
    job_id = serving.submit()
    serving.end_of(job_id)
    serving.stop()
    with filled(disk):
        status, said = serving.refused()
    assert status == 2
    assert said == (
        f"error: the data folder '{disk / 'data'}' cannot be used (No space left on device: "
        f"'{disk / 'data'}'); check its permissions and the free space, or set OCCLUDER_DATA to "
        "another folder\n"
    )
    serving.start()
    serving.assert_served_whole(job_id)


@pytest.mark.faults
def test_a_job_whose_work_finds_no_room_is_done_once_there_is_some(disk, server):
    """There is room for rows, so that the job could be ended; but none for what it makes."""
    serving = server(
        data=disk / "data", OCCLUDER_WORKERS="1", OCCLUDER_MIN_FREE="0", OCCLUDER_ATTEMPTS="1"
    ).start()
    serving.end_of(serving.submit())
    with filled(disk, left=1 << 20):
        job_id = serving.submit("# fill 4000000")
        put_off = until(lambda: (job := serving.job(job_id))["attempts"] > 1 and job)
        assert (put_off["state"], put_off["failure"]) == ("queued", None)
    job = serving.end_of(job_id)
    assert job["state"] == "succeeded", job
    assert 2 <= job["attempt"] == job["attempts"]
    serving.assert_served_whole(job_id)
    print(f"done in attempt {job['attempt']}")


@pytest.mark.faults
def test_a_disk_that_is_full_again_and_again_loses_nothing(disk, server):
    rng = random.Random(3)
    serving = server(
        data=disk / "data", OCCLUDER_WORKERS="2", OCCLUDER_MIN_FREE="0", OCCLUDER_ATTEMPTS="20",
        OCCLUDER_CLEAN_SECONDS="0.5",
    ).start()  # fmt: skip
    accepted, refused = [], 0
    for number in range(20):
        with filled(disk, left=rng.randrange(0, 400_000)):
            for size in rng.choices([100, 5_000, 60_000], k=4):
                answer = serving.post(
                    body=f"# fill {size}\n# {number} {len(accepted)}\n".encode() + BOX
                )
                if answer.status_code == 507:
                    refused += 1
                else:
                    assert answer.status_code == 202, answer.text
                    accepted.append(answer.json()["id"])
            if rng.random() < 0.3:
                os.kill(rng.choice(serving.workers or [serving.process.pid]), signal.SIGKILL)
    states = [serving.end_of(job_id)["state"] for job_id in accepted]
    assert set(states) <= {"succeeded", "failed"}
    for job_id in accepted:
        job = serving.job(job_id)
        if job["state"] == "failed":
            assert job["failure"]["kind"] == "disk-full", job
        serving.assert_served_whole(job_id)
    serving.stop()
    assert jobs_left(serving.data).keys() == set(accepted)
    serving.start()
    cleaned = serving.log.count("cleaning freed")
    until(lambda: serving.log.count("cleaning freed") > cleaned)
    serving.stop()
    assert_folder_is_clean(serving.data)
    print(f"{len(accepted)} jobs, {states.count('failed')} failed, {refused} uploads refused")
