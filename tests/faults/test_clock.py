"""A time of day that jumps, while jobs are done, waited for and told of."""

from __future__ import annotations

import json
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from datetime import datetime

import pytest

from tests.faults.remains import assert_folder_is_clean, jobs_left
from tests.service.real import BOX
from tests.service.webhooks.receivers import receiving
from tests.waiting import until

DAY = 86_400.0
JUMPS = (DAY, -DAY)
"""By how much it is wrong: a day ahead, then, two days back, a day behind."""


@pytest.fixture
def clock(tmp_path):
    """``clock(seconds)`` sets the servers' time of day wrong; by none at first."""
    file = tmp_path / "clock"

    def set_wrong(seconds):
        new = file.with_suffix(".new")
        new.write_text(str(seconds))
        new.replace(file)

    set_wrong(0.0)
    set_wrong.file = str(file)
    return set_wrong


def follow(serving, job_id, heard):
    """The states that a stream of events tells, until it ends."""
    with serving.stream(f"/v1/jobs/{job_id}/events") as answer:
        states = []
        for line in answer.iter_lines():
            heard.set()
            if line.startswith("data: ") and '"state"' in line:
                states.append(json.loads(line.removeprefix("data: "))["state"])
        return states


def beat_of(serving, job_id):
    """Rises with each renewal of a running job's lease."""
    with closing(sqlite3.connect(serving.data / "occluder.db")) as database:
        return database.execute("SELECT beat FROM jobs WHERE id = ?", [job_id]).fetchone()[0]


@pytest.mark.faults
def test_jumps_of_the_clock_lose_nothing_and_repeat_nothing(server, clock, tmp_path):
    refusals = [(503, {})] * 1000  # until the clock has run back: so webhooks wait then
    with (
        receiving(*refusals) as receiver,
        ThreadPoolExecutor() as pool,
        ExitStack() as at_end,
    ):
        serving = server(
            FAULTS_CLOCK=clock.file, OCCLUDER_WORKERS="2", OCCLUDER_LEASE_SECONDS="1",
            OCCLUDER_KEEP_DAYS="0.75", OCCLUDER_CLEAN_SECONDS="0.1",
            OCCLUDER_WEBHOOK_PRIVATE="true",
        ).start()  # fmt: skip
        at_end.callback(serving.kill)  # or whoever follows a job would wait for ever
        hook = f"&webhook={receiver.url}"
        ids = [serving.submit("# before", hook)]
        serving.end_of(ids[0])
        for number, jump in enumerate(JUMPS):
            gate, heard = tmp_path / f"gate{number}", threading.Event()
            ids.append(serving.submit(f"# wait {gate}", hook))
            following = pool.submit(follow, serving, ids[-1], heard)
            waiting = pool.submit(
                serving.post, f"/v1/occluders?filename=box.obj{hook}",
                f"# wait {gate}\n#\n".encode() + BOX, {"Prefer": "wait=30"},
            )  # fmt: skip
            assert heard.wait(30)
            until(lambda: len(serving.jobs()) == len(ids) + 1)
            # One more webhook has been put off by now, by the clock as it was.
            until(lambda: serving.log.count("is tried again") > number)  # noqa: B023
            clock(jump)
            if jump < 0.0:
                receiver.answers.clear()
            ids.append(serving.jobs()[0]["id"])
            ids.append(serving.submit(f"# after {number}", hook))
            beats = beat_of(serving, ids[-3])
            until(lambda: beat_of(serving, ids[-3]) >= beats + 2)  # noqa: B023 - more than a lease
            cleaned = serving.log.count("cleaning freed")
            until(lambda: serving.log.count("cleaning freed") > cleaned + 1)  # noqa: B023
            gate.touch()
            assert following.result(30)[-1] == "succeeded"
            assert waiting.result(60).status_code == 200
            serving.end_of(ids[-1])
        jobs = serving.jobs()
        assert [job["id"] for job in jobs] == ids[::-1]
        assert {(job["state"], job["attempt"]) for job in jobs} == {("succeeded", 1)}
        until(lambda: serving.log.count(" was heard") == len(ids), 60.0)
        serving.stop()
    assert all(job.ends == 1 for job in jobs_left(serving.data).values())
    assert_folder_is_clean(serving.data)
    assert "Traceback" not in serving.log
    days = [datetime.fromisoformat(job["created"]).day for job in jobs]
    assert len(set(days)) > 1  # the clock was wrong indeed
