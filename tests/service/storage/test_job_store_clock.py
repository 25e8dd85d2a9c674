"""Clocks that jump: no job is lost, done twice, tried in vain or stuck."""

from __future__ import annotations

import pytest

from service.jobs.job import JobState
from service.jobs.stores import JobFilter
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import DIED, Clock, results, submission, summary

HOUR = 3600.0
LEASE = 30.0

pytestmark = pytest.mark.parametrize("jump", [HOUR, -24 * HOUR])


def test_a_job_that_is_worked_at_stays_with_its_holder(
    jobs: SqlJobStore, clock: Clock, monotonic: Clock, jump: float
) -> None:
    jobs.submit(submission(), 10)
    held = jobs.claim("one", LEASE)
    assert held is not None
    clock.now += jump
    monotonic.now += LEASE - 1.0
    assert jobs.recover(DIED, all_leases=False) == []
    assert jobs.renew([held], LEASE) == {held.job.id: False}
    monotonic.now += LEASE - 1.0
    assert jobs.recover(DIED, all_leases=False) == []
    assert jobs.succeed(held, results(), summary())


def test_a_silent_job_is_taken_back_in_time(
    jobs: SqlJobStore, clock: Clock, monotonic: Clock, jump: float
) -> None:
    job, _ = jobs.submit(submission(), 10)
    jobs.claim("one", LEASE)
    clock.now += jump
    monotonic.now += LEASE + 1.0
    assert [(one.id, one.state) for one in jobs.recover(DIED, all_leases=False)] == [
        (job.id, JobState.QUEUED)
    ]
    again = jobs.claim("two", LEASE)
    assert again is not None
    assert again.job.attempt == 2


def test_the_job_of_another_server_is_taken_back_when_it_is_silent(
    database: Database, clock: Clock, jump: float
) -> None:
    theirs = SqlJobStore(database, clock, Clock(5.0))
    theirs.submit(submission(), 10)
    held = theirs.claim("they", LEASE)
    assert held is not None
    clock.now += jump
    our_monotonic = Clock(9e9)  # no two machines count from the same moment
    ours = SqlJobStore(database, clock, our_monotonic)
    for _ in range(3):
        assert ours.recover(DIED, all_leases=False) == []
        our_monotonic.now += LEASE - 1.0
        theirs.renew([held], LEASE)
    assert ours.recover(DIED, all_leases=False) == []
    our_monotonic.now += LEASE + 1.0
    assert len(ours.recover(DIED, all_leases=False)) == 1


def test_order_does_not_depend_on_the_clock(jobs: SqlJobStore, clock: Clock, jump: float) -> None:
    ids = []
    for text in "abc":
        ids.append(jobs.submit(submission(text), 10)[0].id)
        clock.now += jump
    listed = jobs.jobs("studio", JobFilter(), before=None, limit=10).jobs
    assert [job.id for job in listed] == ids[::-1]
    claims = [jobs.claim("one", LEASE) for _ in ids]
    assert [claim.job.id for claim in claims if claim] == ids
    clock.now += jump
    assert all(jobs.succeed(claim, results(), summary()) for claim in claims if claim)
