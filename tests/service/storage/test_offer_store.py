"""Jobs that are offered by name: the same turns, limits and fences as where workers take them."""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sqlalchemy import text

from service.jobs.job import Claim, JobState, Priority
from service.jobs.turns import Shares
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.offer_store import SqlOffers
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import DIED, Clock, results, submission, summary

LEASE = 30.0


@pytest.fixture
def offers(database: Database, monotonic: Clock) -> SqlOffers:
    return SqlOffers(database, monotonic=monotonic)


def submit(jobs: SqlJobStore, tenant: str = "studio", priority: Priority = Priority.BULK) -> str:
    asked = submission("a", tenant=tenant, priority=priority, may_reuse=False)
    return jobs.submit(asked, 10**6)[0].id


def claimed(offers: SqlOffers, job_id: str, owner: str = "ray-1") -> Claim:
    claim = offers.claim(job_id, owner, LEASE, Shares())
    assert claim is not None
    return claim


@settings(max_examples=40)
@example([("c", Priority.BULK), ("b", Priority.BULK), ("c", Priority.INTERACTIVE)], 0, 1)
@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(list(Priority))), max_size=20),
    st.integers(0, 8),
    st.sampled_from([None, 1, 2]),
)
def test_offers_come_in_the_order_in_which_workers_would_take_them(
    submitted: list[tuple[str, Priority]], begun: int, running: int | None
) -> None:
    """And one that is claimed by name leaves its tenant's line as one that is taken in turn."""
    with tempfile.TemporaryDirectory() as folder:
        shares, taken, lines = Shares(4, running=running), [], []
        for by_name in (False, True):
            database = fresh_database(Path(folder) / f"{by_name}.db")
            jobs = SqlJobStore(database, Clock(), Clock(), shares)
            offers = SqlOffers(database, monotonic=Clock())
            names = {submit(jobs, *one): number for number, one in enumerate(submitted)}
            for _ in range(begun):
                jobs.claim("one", LEASE)
            if by_name:
                wanted = [job.id for job, _ in offers.next_in_turn(shares, 30)]
                claims = [offers.claim(one, "ray-1", LEASE, shares) for one in wanted]
                assert None not in claims
            else:
                claims = list(iter(lambda jobs=jobs: jobs.claim("ray-1", LEASE), None))
            taken.append([names[claim.job.id] for claim in claims if claim is not None])
            with database.reading() as session:
                lines.append(session.execute(text("SELECT * FROM lines ORDER BY tenant")).all())
            database.close()
    assert taken[0] == taken[1]
    assert lines[0] == lines[1]


def test_no_more_are_told_than_asked_for(jobs: SqlJobStore, offers: SqlOffers) -> None:
    for number in range(6):
        submit(jobs, random.Random(number).choice("abc"))
    whole = [job.id for job, _ in offers.next_in_turn(Shares(), 100)]
    for limit in range(7):
        assert [job.id for job, _ in offers.next_in_turn(Shares(), limit)] == whole[:limit]


def test_what_is_in_a_pause_is_not_offered_before_its_end(
    jobs: SqlJobStore, offers: SqlOffers, monotonic: Clock
) -> None:
    job_id = submit(jobs)
    claim = claimed(offers, job_id)
    assert jobs.fail(claim, DIED, final=False) is JobState.QUEUED
    assert not offers.next_in_turn(Shares(), 1)
    assert offers.claim(job_id, "ray-2", LEASE, Shares()) is None
    monotonic.now += 3600.0
    assert [job.id for job, _ in offers.next_in_turn(Shares(), 1)] == [job_id]
    assert claimed(offers, job_id, "ray-2").job.attempt == 2


def test_a_job_is_begun_once_however_often_it_is_offered(
    jobs: SqlJobStore, offers: SqlOffers
) -> None:
    job_id = submit(jobs)
    claimed(offers, job_id)
    assert offers.claim(job_id, "ray-2", LEASE, Shares()) is None
    assert jobs.claim("one", LEASE) is None


def test_what_outlives_its_node_is_not_heard(jobs: SqlJobStore, offers: SqlOffers) -> None:
    """The job was taken back and begun anew; the first attempt still delivers."""
    job_id = submit(jobs)
    lost = claimed(offers, job_id, "ray-1")
    back = offers.take_back(job_id, "ray-1", DIED)
    assert back is not None
    assert (back.state, back.attempt) == (JobState.QUEUED, 1)
    again = claimed(offers, job_id, "ray-2")
    assert not jobs.succeed(lost, results("late"), summary())
    assert offers.take_back(job_id, "ray-1", DIED) is None
    assert jobs.succeed(again, results("right"), summary())
    assert offers.take_back(job_id, "ray-2", DIED) is None


def test_attempts_count_where_an_owner_is_lost_and_not_where_it_gives_back(
    jobs: SqlJobStore, offers: SqlOffers
) -> None:
    job_id = submit(jobs)
    claimed(offers, job_id)
    given = offers.take_back(job_id, "ray-1", None)
    assert given is not None
    assert given.attempts - given.attempt == 3
    for left in (2, 1, 0):
        claimed(offers, job_id)
        back = offers.take_back(job_id, "ray-1", DIED)
        assert back is not None
        assert back.attempts - back.attempt == left
    assert (back.state, back.failure) == (JobState.FAILED, DIED)


def test_a_job_whose_end_was_asked_for_is_not_begun_again(
    jobs: SqlJobStore, offers: SqlOffers
) -> None:
    job_id = submit(jobs)
    claimed(offers, job_id)
    jobs.cancel(None, job_id)
    back = offers.take_back(job_id, "ray-1", DIED)
    assert back is not None
    assert back.state is JobState.CANCELLED
