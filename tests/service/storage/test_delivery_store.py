"""Webhooks: put down when a job ends, however it does, and kept until they were heard."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from service.errors import NotFoundError
from service.jobs.deliveries import Delivery, DeliveryAttempt, DeliveryFilter, DeliveryState
from service.jobs.job import Claim, JobState
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import DIED, Clock, results, submission, summary

URL = "https://example.org/hook"
HEARD = DeliveryAttempt(1_700_000_000.0, 12.5, 204)
REFUSED = DeliveryAttempt(1_700_000_001.0, 3.5, 500, "it answered 500", "no such hook")


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
    deliveries.confirm(delivery, HEARD)
    assert deliveries.due(10) == []


def test_what_was_given_up_is_not_due_again(
    deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock
) -> None:
    deliveries.give_up(delivery, REFUSED)
    clock.now += 1e6
    assert deliveries.due(10) == []


def test_a_second_try_waits(deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock) -> None:
    deliveries.postpone(delivery, REFUSED, 60.0)
    clock.now += 59.0
    assert deliveries.due(10) == []
    clock.now += 1.0
    (again,) = deliveries.due(10)
    assert (again.id, again.attempt, again.due) == (delivery.id, 1, clock.now)


@pytest.mark.parametrize("jump", [3600.0, -86400.0])
def test_a_clock_that_jumps_keeps_no_webhook_back(
    deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock, jump: float
) -> None:
    deliveries.postpone(delivery, REFUSED, 60.0)
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
    deliveries.postpone(delivery, REFUSED, 60.0)
    clock.now += 100.0
    assert deliveries.due(10) == []


def test_each_try_is_in_the_log(
    deliveries: SqlDeliveryStore, delivery: Delivery, clock: Clock
) -> None:
    deliveries.postpone(delivery, REFUSED, 60.0)
    clock.now += 60.0
    (again,) = deliveries.due(10)
    deliveries.confirm(again, HEARD)
    record = deliveries.record("studio", delivery.id)
    assert (record.state, record.attempts) == (DeliveryState.DELIVERED, (REFUSED, HEARD))
    assert (record.delivery.attempt, record.delivery.url) == (2, URL)


def test_the_log_is_a_tenants_own_and_goes_page_by_page(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore
) -> None:
    for text, tenant in (("a", "studio"), ("b", "other"), ("c", "studio"), ("d", "studio")):
        job, _ = jobs.submit(submission(text, webhook=URL, tenant=tenant), 10)
        jobs.cancel(tenant, job.id)
    first = deliveries.page("studio", DeliveryFilter(), before=None, limit=2)
    rest = deliveries.page("studio", DeliveryFilter(), before=first.cursor, limit=2)
    assert [len(first.records), len(rest.records), rest.cursor] == [2, 1, None]
    theirs = [one.delivery for one in (*first.records, *rest.records)]
    assert {one.tenant for one in theirs} == {"studio"}
    assert theirs[0].job_id == job.id
    assert len(deliveries.page(None, DeliveryFilter(), before=None, limit=9).records) == 4
    of_job = DeliveryFilter(job_id=job.id)
    assert len(deliveries.page("studio", of_job, before=None, limit=9).records) == 1
    deliveries.give_up(theirs[1], REFUSED)
    lost = deliveries.page(
        "studio", DeliveryFilter(DeliveryState.GIVEN_UP), before=None, limit=9
    ).records
    assert [one.delivery.id for one in lost] == [theirs[1].id]
    with pytest.raises(NotFoundError):
        deliveries.record("other", theirs[1].id)


@pytest.mark.parametrize("attempt", [HEARD, REFUSED])
def test_by_hand_it_is_due_again_with_all_its_tries(
    deliveries: SqlDeliveryStore, delivery: Delivery, attempt: DeliveryAttempt
) -> None:
    (deliveries.give_up if attempt.reason else deliveries.confirm)(delivery, attempt)
    with pytest.raises(NotFoundError):
        deliveries.redeliver("other", delivery.id)
    assert deliveries.redeliver("studio", delivery.id).state is DeliveryState.WAITING
    (again,) = deliveries.due(10)
    assert (again.id, again.attempt, again.redelivered) == (delivery.id, 0, 1)
    assert deliveries.record("studio", delivery.id).attempts == (attempt,)


def test_a_try_that_began_before_does_not_answer_who_asks_by_hand(
    deliveries: SqlDeliveryStore, delivery: Delivery
) -> None:
    deliveries.redeliver("studio", delivery.id)
    deliveries.confirm(delivery, HEARD)
    record = deliveries.record("studio", delivery.id)
    assert (record.state, record.attempts) == (DeliveryState.WAITING, (HEARD,))
    (again,) = deliveries.due(10)
    deliveries.confirm(again, HEARD)
    assert deliveries.due(10) == []


def test_the_log_of_a_delivery_has_an_end(
    deliveries: SqlDeliveryStore, delivery: Delivery, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.storage.delivery_store._ATTEMPTS_KEPT", 3)
    for status in range(500, 505):
        deliveries.postpone(delivery, replace(REFUSED, status=status), 0.0)
    kept = deliveries.record("studio", delivery.id).attempts
    assert [one.status for one in kept] == [502, 503, 504]


def test_a_claimed_delivery_is_left_alone_until_the_claim_ends(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore, clock: Clock
) -> None:
    jobs.succeed(claimed(jobs), results(), summary())
    (mine,) = deliveries.claim(deliveries.due(10), "me", 30.0)
    assert mine.owner == "me"
    assert deliveries.due(10) == []
    clock.now += 31.0
    seen = deliveries.due(10)
    (theirs,) = deliveries.claim(seen, "they", 30.0)
    assert deliveries.claim(seen, "me", 30.0) == []
    deliveries.postpone(mine, REFUSED, 5.0)  # who was too late decides nothing
    assert deliveries.due(10) == []
    deliveries.confirm(theirs, HEARD)
    record = deliveries.record(None, mine.id)
    assert (record.state, len(record.attempts)) == (DeliveryState.DELIVERED, 2)


def test_who_sends_alone_forgets_what_a_sender_of_before_has_claimed(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore
) -> None:
    jobs.succeed(claimed(jobs), results(), summary())
    deliveries.claim(deliveries.due(10), "a dead sender", 3600.0)
    assert deliveries.due(10) == []
    deliveries.release_all()
    (free,) = deliveries.due(10)
    assert free.owner is None


def test_what_is_asked_for_by_hand_is_sent_whoever_has_it(
    jobs: SqlJobStore, deliveries: SqlDeliveryStore
) -> None:
    jobs.succeed(claimed(jobs), results(), summary())
    (mine,) = deliveries.claim(deliveries.due(10), "me", 3600.0)
    deliveries.redeliver(None, mine.id)
    assert [one.id for one in deliveries.due(10)] == [mine.id]
