"""Webhooks: put down when a job ends, however it does, and kept until they were heard."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from service.jobs.job import Claim, JobState
from service.jobs.stores import Delivery
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import DIED, Clock, results, submission, summary

URL = "https://example.org/hook"


def claimed(jobs: SqlJobStore, text: str = "a cube", attempts: int = 1) -> Claim:
    jobs.submit(submission(text, webhook=URL, attempts=attempts), 10)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    return claim


ENDS: dict[str, Callable[[SqlJobStore, Claim], object]] = {
    "succeed": lambda jobs, claim: jobs.succeed(claim, results(), summary()),
    "fail": lambda jobs, claim: jobs.fail(claim, DIED, final=True),
    "fail the last time": lambda jobs, claim: jobs.fail(claim, DIED, final=False),
    "end cancelled": lambda jobs, claim: jobs.end_cancelled(claim),
    "recover": lambda jobs, _: jobs.recover(DIED, all_leases=True),
}


@pytest.mark.parametrize("how", ENDS)
def test_the_end_of_a_job_is_told_once(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore, clock: Clock, how: str
) -> None:
    claim = claimed(jobs)
    assert deliveries.due(10) == []
    ENDS[how](jobs, claim)
    ENDS[how](jobs, claim)
    (delivery,) = deliveries.due(10)
    assert delivery == Delivery(delivery.id, "studio", claim.job.id, URL, 0, clock.now)


def test_the_end_at_submission_is_told(jobs: SqlJobStore, deliveries: SqlDeliveryStore) -> None:
    claim = claimed(jobs)
    jobs.succeed(claim, results(), summary())
    again, _ = jobs.submit(submission(webhook=URL), 10)
    assert again.state is JobState.SUCCEEDED
    assert [one.job_id for one in deliveries.due(10)] == [claim.job.id, again.id]


def test_the_end_of_a_queued_job_is_told(jobs: SqlJobStore, deliveries: SqlDeliveryStore) -> None:
    job, _ = jobs.submit(submission(webhook=URL), 10)
    jobs.cancel("studio", job.id)
    assert [one.job_id for one in deliveries.due(10)] == [job.id]


def test_an_attempt_that_is_followed_by_another_is_not_told(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore
) -> None:
    assert jobs.fail(claimed(jobs, attempts=2), DIED, final=False) is JobState.QUEUED
    assert deliveries.due(10) == []


def test_a_job_without_a_webhook_tells_nobody(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore
) -> None:
    job, _ = jobs.submit(submission(), 10)
    jobs.cancel("studio", job.id)
    assert deliveries.due(10) == []


@pytest.fixture
def delivery(jobs: SqlJobStore, deliveries: SqlDeliveryStore) -> Delivery:
    job, _ = jobs.submit(submission(webhook=URL), 10)
    jobs.cancel("studio", job.id)
    (delivery,) = deliveries.due(10)
    return delivery


def test_what_was_heard_is_not_due_again(deliveries: SqlDeliveryStore, delivery: Delivery) -> None:
    deliveries.confirm(delivery)
    assert deliveries.due(10) == []


def test_what_was_given_up_is_not_due_again(
    deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock
) -> None:
    deliveries.give_up(delivery, "it answered 500")
    clock.now += 1e6
    assert deliveries.due(10) == []


def test_a_second_try_waits(deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock) -> None:
    deliveries.postpone(delivery, 60.0, "it answered 500")
    clock.now += 59.0
    assert deliveries.due(10) == []
    clock.now += 1.0
    (again,) = deliveries.due(10)
    assert (again.id, again.attempt, again.due) == (delivery.id, 1, clock.now)


@pytest.mark.parametrize("jump", [3600.0, -86400.0])
def test_a_clock_that_jumps_keeps_no_webhook_back(
    deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock, jump: float
) -> None:
    deliveries.postpone(delivery, 60.0, "it answered 500")
    clock.now += jump
    assert [one.id for one in deliveries.due(10)] == [delivery.id]


def test_the_oldest_are_tried_first(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore, clock: Clock
) -> None:
    ids = []
    for text in "abc":
        job, _ = jobs.submit(submission(text, webhook=URL), 10)
        ids.append(jobs.cancel("studio", job.id).id)
        clock.now += 1.0
    assert [one.job_id for one in deliveries.due(2)] == ids[:2]


def test_a_forgotten_job_takes_its_webhook_along(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock
) -> None:
    assert jobs.expire(clock.now + 1.0) == 1
    deliveries.postpone(delivery, 60.0, "it answered 500")
    clock.now += 100.0
    assert deliveries.due(10) == []
