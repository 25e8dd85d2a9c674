"""Who may still speak for a job, what a full queue takes, and where a page ends."""

from __future__ import annotations

import pytest

from service.errors import QueueFullError
from service.jobs.job import JobState
from service.jobs.stores import JobFilter
from service.storage.job_store import SqlJobStore
from service.storage.leases import Beat, LeaseWatch
from tests.service.storage.samples import DIED, Clock, results, submission, summary

LEASE = 30.0
LONG = 1000.0
"""Seconds that no pause between two attempts takes."""


def claimed(jobs: SqlJobStore, text: str = "a cube", owner: str = "one", **changes: object):
    jobs.submit(submission(text, **changes), queue_limit=1000)
    held = jobs.claim(owner, LEASE)
    assert held is not None
    return held


def ended(jobs: SqlJobStore, text: str, **changes: object):
    held = claimed(jobs, text, **changes)
    assert jobs.succeed(held, results(text), summary())
    return held


def test_a_claim_of_a_forgotten_job_is_not_heard(jobs: SqlJobStore, clock: Clock) -> None:
    gone, kept = claimed(jobs, "gone"), claimed(jobs, "kept")
    jobs.cancel(None, gone.job.id)
    assert jobs.end_cancelled(gone)
    clock.now += 1.0
    assert jobs.expire(ended_before=clock.now) == 1
    assert jobs.renew([gone, kept], LEASE) == {kept.job.id: False}
    assert not jobs.succeed(gone, results(), summary())
    assert jobs.fail(gone, DIED, final=False) is None
    assert not jobs.end_cancelled(gone)
    assert not jobs.release(gone)


def test_another_owners_claim_of_the_same_attempt_is_not_heard(
    jobs: SqlJobStore, monotonic: Clock
) -> None:
    """And of the same owner, one of another attempt; both must be right."""
    first = claimed(jobs, attempts=3)
    assert jobs.fail(first, DIED, final=False) is JobState.QUEUED
    monotonic.now += LONG
    second = jobs.claim("one", LEASE)
    assert second is not None
    for stranger in (type(second)(second.job, "another", second.inputs), first):
        assert jobs.renew([stranger], LEASE) == {}
        assert not jobs.succeed(stranger, results(), summary())
        assert not jobs.release(stranger)
        assert jobs.put_off(stranger, DIED) is None
        assert jobs.fail(stranger, DIED, final=True) is None
        assert not jobs.end_cancelled(stranger)
    assert jobs.renew([second], LEASE) == {second.job.id: False}


def test_a_queue_that_is_full_says_so_before_the_body_has_come(jobs: SqlJobStore) -> None:
    claimed(jobs, "running")
    jobs.submit(submission("first"), queue_limit=1)
    with pytest.raises(QueueFullError, match="1"):
        jobs.check_room("studio", queue_limit=1)
    jobs.check_room("studio", queue_limit=2)
    jobs.submit(submission("other", tenant="rival"), queue_limit=1)  # its first is never refused
    with pytest.raises(QueueFullError):
        jobs.check_room("rival", queue_limit=1)


def test_room_is_for_as_many_as_the_limit_says(jobs: SqlJobStore) -> None:
    for number in range(3):
        jobs.submit(submission(str(number)), queue_limit=3)
    with pytest.raises(QueueFullError):
        jobs.submit(submission("one too many"), queue_limit=3)
    assert jobs.counts()[JobState.QUEUED] == 3


def test_a_page_that_takes_all_that_are_left_is_the_last(jobs: SqlJobStore) -> None:
    for text in "abcd":
        jobs.submit(submission(text), queue_limit=10)
    first = jobs.jobs("studio", JobFilter(), before=None, limit=2)
    assert first.cursor == first.jobs[-1].number
    assert jobs.jobs("studio", JobFilter(), before=first.cursor, limit=2).cursor is None


def test_work_that_was_done_is_given_from_where_it_was_done_first(jobs: SqlJobStore) -> None:
    """A copy of a copy names the job that did the work, and only success counts."""
    failed = claimed(jobs, "cube", attempts=1)
    jobs.fail(failed, DIED, final=True)
    done = ended(jobs, "cube")
    for _ in range(2):
        copy, _ = jobs.submit(submission("cube"), queue_limit=10)
        assert copy.reused == done.job.id


def test_a_lease_ends_after_its_length_and_not_before(jobs: SqlJobStore, monotonic: Clock) -> None:
    """To the second, of the latest sign of life, by the length that it was given with."""
    held = claimed(jobs, attempts=3)
    monotonic.now += LEASE
    assert jobs.recover(DIED, all_leases=False) == []
    assert jobs.renew([held], 2 * LEASE) == {held.job.id: False}
    monotonic.now += 2 * LEASE
    assert jobs.recover(DIED, all_leases=False) == []
    monotonic.now += 0.001
    assert [job.id for job in jobs.recover(DIED, all_leases=False)] == [held.job.id]
    assert jobs.recover(DIED, all_leases=False) == []


def test_a_claim_begins_its_lease_anew(jobs: SqlJobStore, monotonic: Clock) -> None:
    """Whatever was seen of the attempt before it."""
    first = claimed(jobs, attempts=3)
    monotonic.now += LEASE
    assert jobs.release(first)
    assert jobs.claim("two", LEASE) is not None
    monotonic.now += LEASE
    assert jobs.recover(DIED, all_leases=False) == []
    monotonic.now += 0.001
    assert len(jobs.recover(DIED, all_leases=False)) == 1


def test_a_server_that_begins_takes_all_jobs_back_at_once(jobs: SqlJobStore) -> None:
    texts = "abc"
    held = [claimed(jobs, text, attempts=2) for text in texts]
    taken = jobs.recover(DIED, all_leases=True)
    assert [job.id for job in taken] == [one.job.id for one in held]
    assert all(job.state is JobState.QUEUED for job in taken)


def test_a_watch_forgets_jobs_that_run_no_more() -> None:
    """Else it would grow for as long as the server runs."""
    clock = Clock(5.0)
    watch = LeaseWatch(clock)
    for job_id in ("kept", "gone"):
        watch.note(job_id, Beat(1, 0))
    clock.now += 7.0
    watch.keep_only({"kept"})
    assert watch.silence("kept", Beat(1, 0)) == 7.0
    assert watch.silence("gone", Beat(1, 0)) == 0.0


@pytest.mark.parametrize("final", [True, False])
def test_a_job_to_be_cancelled_that_fails_for_good_has_failed(
    jobs: SqlJobStore, final: bool
) -> None:
    """Only what might have been tried again is cancelled in its place."""
    held = claimed(jobs, attempts=3)
    jobs.cancel(None, held.job.id)
    assert jobs.fail(held, DIED, final=final) is (JobState.FAILED if final else JobState.CANCELLED)
    assert jobs.job(None, held.job.id).failure == (DIED if final else None)
