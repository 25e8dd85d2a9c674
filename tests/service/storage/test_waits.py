"""A job that this machine has failed is tried again, and not at once."""

from __future__ import annotations

from service.jobs.job import Claim, JobState
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import DIED, FULL, Clock, submission

LEASE = 30.0


def begun(jobs: SqlJobStore) -> Claim:
    claim = jobs.claim("one", LEASE)
    assert claim is not None
    return claim


def test_a_job_whose_process_died_waits_longer_each_time_and_others_go_first(
    jobs: SqlJobStore, monotonic: Clock
) -> None:
    first, _ = jobs.submit(submission("first", attempts=3), 10)
    jobs.submit(submission("second"), 10)
    assert jobs.fail(begun(jobs), DIED, final=False) is JobState.QUEUED
    assert begun(jobs).job.id != first.id
    for pause in (0.5, 1.0):
        assert jobs.claim("one", LEASE) is None
        monotonic.now += pause
        again = begun(jobs)
        assert again.job.id == first.id
        last = jobs.fail(again, DIED, final=False)
    assert last is JobState.FAILED


def test_a_full_disk_is_waited_for_at_no_cost_and_for_minutes(
    jobs: SqlJobStore, monotonic: Clock
) -> None:
    job, _ = jobs.submit(submission(attempts=1), 10)
    began = monotonic.now
    claim: Claim | None = begun(jobs)
    tries = 0
    while claim is not None:
        tries += 1
        jobs.put_off(claim, FULL)
        claim = None
        while claim is None and not jobs.job(None, job.id).state.ended:
            monotonic.now += 20.0
            claim = jobs.claim("one", LEASE)
    assert jobs.job(None, job.id).failure == FULL
    assert tries == 10
    assert monotonic.now - began > 1200.0


def test_a_new_start_waits_for_nothing(database, jobs: SqlJobStore, monotonic: Clock) -> None:
    jobs.submit(submission(attempts=3), 10)
    jobs.fail(begun(jobs), DIED, final=False)
    assert jobs.claim("one", LEASE) is None
    anew = SqlJobStore(database, monotonic=monotonic)
    assert anew.recover(DIED, all_leases=True) == []
    assert begun(anew).job.attempt == 2


def test_a_job_that_is_to_be_cancelled_waits_for_no_room(jobs: SqlJobStore) -> None:
    job, _ = jobs.submit(submission(), 10)
    claim = begun(jobs)
    jobs.cancel(None, job.id)
    assert jobs.put_off(claim, FULL) is JobState.CANCELLED
