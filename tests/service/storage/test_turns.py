"""Turns between tenants, priorities within one, and limits for each, against a plain model."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import Connection, Engine, event, text

from service.access.key import Scope
from service.errors import QueueFullError, TenantQueueFullError
from service.jobs.job import Claim, Job, Priority
from service.jobs.turns import IN_A_ROW, Shares
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.key_store import SqlKeyStore
from tests.service.storage.fresh import fresh_database
from tests.service.storage.samples import DIED, Clock, results, submission, summary

BULK, INTERACTIVE = Priority.BULK, Priority.INTERACTIVE


def submit(
    jobs: SqlJobStore, tenant: str = "studio", priority: Priority = INTERACTIVE, limit: int = 10**6
) -> Job:
    asked = submission("a", tenant=tenant, priority=priority, may_reuse=False)
    return jobs.submit(asked, limit)[0]


def begin(jobs: SqlJobStore) -> Claim:
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    return claim


def shared(database: Database, **shares: int) -> SqlJobStore:
    return SqlJobStore(database, Clock(), Clock(), Shares(**shares))


@dataclass
class Line:
    """The jobs of a tenant that wait, by what they are, in the order they came."""

    waiting: list[tuple[str, Priority]] = field(default_factory=list)
    last_turn: int = 0
    in_a_row: int = 0
    running: int = 0

    def next(self) -> str:
        first = {priority: job for job, priority in reversed(self.waiting)}
        bulk_goes = BULK in first and (self.in_a_row >= IN_A_ROW or INTERACTIVE not in first)
        self.in_a_row = 0 if bulk_goes or BULK not in first else self.in_a_row + 1
        return first[BULK if bulk_goes else INTERACTIVE]


ACTS = st.lists(
    st.one_of(
        st.tuples(st.sampled_from(["sieve", "loom", "anvil"]), st.sampled_from(list(Priority))),
        st.just("claim"),
        st.just("claim"),
        st.just("end"),
    ),
    max_size=40,
)


@settings(max_examples=60)
@given(ACTS, st.sampled_from([None, 1, 2]))
def test_the_store_does_as_a_plain_model(acts: list[object], running: int | None) -> None:
    """And each tenant has its turn, and each bulk job, after as many others as is promised."""
    with tempfile.TemporaryDirectory() as folder:
        database = fresh_database(Path(folder) / "occluder.db")
        jobs = SqlJobStore(database, Clock(), Clock(), Shares(2, running=running))
        lines: dict[str, Line] = {}
        begun: list[Claim] = []
        turn = 0
        for act in acts:
            if isinstance(act, tuple):
                tenant, priority = act
                job = submit(jobs, tenant, priority)
                lines.setdefault(tenant, Line()).waiting.append((job.id, priority))
            elif act == "claim":
                may = [
                    (
                        line.last_turn,
                        min(jobs.job(None, job).number for job, _ in line.waiting),
                        name,
                    )
                    for name, line in lines.items()
                    if line.waiting and (running is None or line.running < running)
                ]
                claim = jobs.claim("one", 30.0)
                assert (claim is None) == (not may)
                if claim is None:
                    continue
                line = lines[min(may)[2]]
                assert claim.job.id == line.next()
                turn += 1
                line.last_turn, line.running = turn, line.running + 1
                line.waiting = [one for one in line.waiting if one[0] != claim.job.id]
                begun.append(claim)
            elif begun:
                claim = begun.pop(0)
                assert jobs.succeed(claim, results(), summary())
                lines[claim.job.tenant].running -= 1
        foretold = [job.id for _, job in jobs.queue(None, 100)]
        assert [place for place, _ in jobs.queue(None, 100)] == list(range(1, len(foretold) + 1))
        for claim in begun:
            jobs.succeed(claim, results(), summary())
        drained = []
        while (claim := jobs.claim("one", 30.0)) is not None:
            drained.append(claim.job.id)
            jobs.succeed(claim, results(), summary())
        assert drained == foretold
        database.close()


def test_a_single_job_waits_for_one_of_a_thousand(jobs: SqlJobStore) -> None:
    for _ in range(50):
        submit(jobs, "flood")
    for _ in range(10):
        begin(jobs)
    mine = submit(jobs, "studio", BULK)
    assert begin(jobs).job.id == mine.id
    again = submit(jobs, "studio")
    assert [begin(jobs).job.tenant for _ in range(2)] == ["flood", "studio"]
    assert jobs.job(None, again.id).attempt == 1


def test_interactive_goes_first_and_bulk_after_three(jobs: SqlJobStore) -> None:
    for priority in (BULK, BULK, *[INTERACTIVE] * 7):
        submit(jobs, priority=priority)
    begun = "".join(begin(jobs).job.priority[0] for _ in range(9))
    assert begun == "iiibiiibi"


def test_a_job_that_is_tried_again_keeps_its_place_in_its_line(jobs: SqlJobStore) -> None:
    submit(jobs)
    submit(jobs)
    held = begin(jobs)
    jobs.release(held)
    assert begin(jobs).job.id == held.job.id


def test_a_worker_stays_for_others_where_another_has_a_key(
    database: Database, keys: SqlKeyStore
) -> None:
    jobs = shared(database, workers=3)
    keys.create("studio", "farm", Scope.WRITE)
    for _ in range(4):
        submit(jobs)
    assert [begin(jobs).job.tenant for _ in range(3)] == ["studio"] * 3  # nobody else can come
    key, _ = keys.create("rival", "farm", Scope.WRITE)
    assert jobs.claim("one", 30.0) is None
    theirs = submit(jobs, "rival")
    assert begin(jobs).job.id == theirs.id
    keys.revoke(key.id)
    assert begin(jobs).job.tenant == "studio"


@pytest.mark.parametrize(("workers", "running", "begun"), [(1, None, 1), (4, 2, 2), (2, 9, 5)])
def test_a_tenant_runs_no_more_than_it_may(
    database: Database, keys: SqlKeyStore, workers: int, running: int | None, begun: int
) -> None:
    for tenant in ("studio", "rival"):
        keys.create(tenant, "farm", Scope.WRITE)
    jobs = SqlJobStore(database, Clock(), Clock(), Shares(workers, None, running))
    for _ in range(5):
        submit(jobs)
    claims = list(iter(lambda: jobs.claim("one", 30.0), None))
    assert len(claims) == begun
    jobs.fail(claims[0], DIED, final=True)
    assert (jobs.claim("one", 30.0) is not None) == (begun < 5)


def test_one_tenant_takes_half_of_the_queue_where_another_has_a_key(
    database: Database, keys: SqlKeyStore
) -> None:
    jobs = shared(database)
    for _ in range(4):
        submit(jobs, limit=4)
    with pytest.raises(QueueFullError) as full:
        submit(jobs, limit=4)
    assert full.value.slug == "queue-full"
    submit(jobs, "rival", limit=4)  # of whom nothing waits
    keys.create("rival", "farm", Scope.WRITE)
    with pytest.raises(TenantQueueFullError, match="4 jobs of yours"):
        submit(jobs, limit=8)
    submit(jobs, "rival", limit=8)


def test_a_tenant_has_what_the_settings_say(database: Database) -> None:
    jobs = shared(database, waiting=2)
    for _ in range(2):
        submit(jobs)
    with pytest.raises(TenantQueueFullError) as refused:
        submit(jobs)
    assert refused.value.slug == "tenant-queue-full"
    assert "cancel" in refused.value.remedy
    with pytest.raises(TenantQueueFullError):
        jobs.check_room("studio", 1000)


@pytest.mark.parametrize(
    ("seconds", "workers", "waiting", "others", "told"),
    [
        ((30.0, 30.0, 30.0), 1, 5, (), 150),
        ((30.0, 30.0, 30.0), 2, 5, (), 75),
        ((1.0, 30.0, 900.0), 1, 5, (), 150),  # one slow mesh is no measure
        ((30.0,), 1, 2, (9, 1), 30 * (2 + 3 + 1)),  # a turn each
        ((0.001,), 1, 5, (), 1),
        ((900.0,), 1, 5, (), 600),
        ((), 1, 3, (), 15),
    ],
)
def test_retry_after_is_as_slow_as_the_queue(
    database: Database,
    seconds: tuple[float, ...],
    workers: int,
    waiting: int,
    others: tuple[int, ...],
    told: int,
) -> None:
    clock = Clock()
    jobs = SqlJobStore(database, clock, Clock(), Shares(workers, waiting))
    for one in seconds:
        submit(jobs)
        claim = begin(jobs)
        clock.now += one
        jobs.succeed(claim, results(), summary())
    reused, _ = jobs.submit(submission("a"), 10)  # a stored result is no measure either
    assert reused.state.ended == bool(seconds)
    jobs.cancel(None, reused.id) if not seconds else None
    unlimited = shared(database)
    for number, count in enumerate(others):
        for _ in range(count):
            submit(unlimited, f"other {number}")
    for _ in range(waiting):
        submit(jobs)
    with pytest.raises(TenantQueueFullError) as refused:
        submit(jobs)
    assert refused.value.headers["Retry-After"] == str(told)


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SqlJobStore]:
    """100,000 jobs of one tenant that wait, and one of another; most tenants have none."""
    database = fresh_database(tmp_path_factory.mktemp("crowded") / "occluder.db")
    jobs = shared(database)
    first = submit(jobs, "flood")
    with database.writing() as session:
        columns = "tenant, kind, name, options, version, work_key, created, attempt, attempts"
        columns += ", state, priority, cancel_asked, beat, lease_seconds"
        session.execute(
            text(
                f"WITH RECURSIVE n(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM n WHERE n < 99999)"
                f" INSERT INTO jobs (id, {columns})"
                f" SELECT printf('%032d', n), {columns} FROM jobs JOIN n WHERE jobs.id = :id"
            ),
            {"id": first.id},
        )
        session.execute(text("UPDATE lines SET waiting = 100000"))
        for number in range(2000):
            columns = "tenant, turn, streak, waiting, running"
            idle = f"('idle {number}', {number + 1}, 0, 0, 0)"
            session.execute(text(f"INSERT INTO lines ({columns}) VALUES {idle}"))
    yield jobs
    database.close()


def test_a_claim_costs_as_little_with_100_000_waiting(crowded: SqlJobStore) -> None:
    """One statement, whatever waits: most of it is the flush of the transaction."""
    single = submit(crowded, "studio")
    begun, times = [], []
    for _ in range(20):
        start = time.perf_counter()
        begun.append(begin(crowded).job)
        times.append(time.perf_counter() - start)
    assert [job.tenant for job in begun[:3]] == ["flood", "studio", "flood"]
    assert begun[1].id == single.id
    with crowded._database.reading() as session:  # by the same machine, busy as it is
        start = time.perf_counter()
        assert len(session.execute(text("SELECT id, priority, created FROM jobs")).all()) > 99_999
        reading = time.perf_counter() - start
    assert sorted(times)[10] < reading / 5  # an idle machine takes a thirtieth


def test_a_claim_is_found_by_indexes_alone(crowded: SqlJobStore) -> None:
    asked: list[tuple[str, list[str]]] = []

    def explain(
        connection: Connection, cursor: object, statement: str, parameters: object, *_: object
    ) -> None:
        if "heads" in statement:
            raw = connection.connection.cursor()
            raw.execute(f"EXPLAIN QUERY PLAN {statement}", parameters)  # type: ignore[arg-type]
            asked.append((statement, [row[3] for row in raw.fetchall()]))

    event.listen(Engine, "before_cursor_execute", explain)
    try:
        begin(crowded)
    finally:
        event.remove(Engine, "before_cursor_execute", explain)
    ((_, steps),) = asked
    of_jobs = [step for step in steps if " jobs" in step]
    # The first of each priority of each tenant that waits, by an index alone.
    assert len(of_jobs) == 2
    assert all(step.startswith("SEARCH jobs USING COVERING INDEX ix_jobs_line") for step in of_jobs)
    assert "SCAN lines USING INDEX ix_lines_waiting" in steps  # those of whom some wait
