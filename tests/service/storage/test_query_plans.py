"""No query that a full service runs reads a whole table or sorts a long list."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import Connection, Engine, event

from service.idempotency import Answer, KeyedRequest
from service.jobs.job import JobKind, JobState
from service.jobs.stores import JobFilter
from service.storage.answer_store import SqlAnswerStore
from service.storage.asset_store import SqlAssetStore
from service.storage.database import Database
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from service.storage.journal_store import SqlJournal
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from tests.service.storage.samples import DIED, Clock, submission

FAILED = frozenset([JobState.FAILED])
ENDED = frozenset([JobState.FAILED, JobState.SUCCEEDED])


@pytest.fixture
def database(sqlite_database: SqliteDatabase) -> SqliteDatabase:
    return sqlite_database


class Stores:
    """All of them on one database, with a running job of an asset."""

    def __init__(self, database: Database) -> None:
        self.jobs = SqlJobStore(database, Clock())
        self.assets = SqlAssetStore(database)
        self.keys = SqlKeyStore(database)
        self.answers = SqlAnswerStore(database)
        self.journal = SqlJournal(database)
        self.deliveries = SqlDeliveryStore(database)
        job, _ = self.jobs.submit(submission(asset="castle"), 10)
        claim = self.jobs.claim("one", 30.0)
        assert claim is not None
        assert job.asset_id is not None
        self.job_id, self.asset_id, self.claim = job.id, job.asset_id, claim

    def listed(self, tenant: str | None, before: int | None = None, **wanted: object) -> None:
        self.jobs.jobs(tenant, JobFilter(**wanted), before=before, limit=50)  # type: ignore[arg-type]


CALLS: dict[str, Callable[[Stores], object]] = {
    "submit": lambda all_: all_.jobs.submit(submission("b", asset="x"), 10),
    "job": lambda all_: all_.jobs.job("studio", all_.job_id),
    "files": lambda all_: all_.jobs.files(all_.job_id),
    "claim": lambda all_: all_.jobs.claim("one", 30.0),
    "renew": lambda all_: all_.jobs.renew([all_.claim], 30.0),
    "fail": lambda all_: all_.jobs.fail(all_.claim, DIED, final=True),
    "recover": lambda all_: all_.jobs.recover(DIED, all_leases=False),
    "unnamed": lambda all_: all_.jobs.unnamed(["0" * 64, "f" * 64]),
    "expire": lambda all_: all_.jobs.expire(0.0),
    "list": lambda all_: all_.listed("studio"),
    "next page": lambda all_: all_.listed("studio", before=500),
    "of a state": lambda all_: all_.listed("studio", states=FAILED),
    "of states": lambda all_: all_.listed("studio", states=ENDED),
    "of a kind": lambda all_: all_.listed("studio", kinds=frozenset([JobKind.SCENE])),
    "of a time": lambda all_: all_.listed("studio", created_from=1.0, created_before=2.0),
    "of a state of an asset": lambda all_: all_.listed(
        "studio", asset_id=all_.asset_id, states=FAILED
    ),
    "of a state of all tenants": lambda all_: all_.listed(None, states=FAILED),
    "assets": lambda all_: all_.assets.assets("studio"),
    "assets of all tenants": lambda all_: all_.assets.assets(None),
    "assets by name": lambda all_: all_.assets.assets("studio", name="castle"),
    "next assets": lambda all_: all_.assets.assets("studio", after="3:castle"),
    "asset": lambda all_: all_.assets.asset("studio", all_.asset_id),
    "runs": lambda all_: all_.assets.runs("studio", all_.asset_id),
    "removed assets": lambda all_: all_.assets.removed("studio"),
    "assets to be removed": lambda all_: all_.assets.remove_due(5.0),
    "thresholds of folders": lambda all_: all_.assets.folder_thresholds("studio"),
    "queue": lambda all_: all_.jobs.queue("studio", 10),
    "runs at a time": lambda all_: all_.assets.runs_at("studio", 5.0),
    "key": lambda all_: all_.keys.find("occ_none"),
    "answer": lambda all_: all_.answers.once(
        KeyedRequest("studio", "k", "f" * 64), lambda: Answer(204)
    ),
    "answer that is known": lambda all_: all_.answers.known("studio", "k"),
    "answers that are old": lambda all_: all_.answers.expire(5.0),
    "journal": lambda all_: all_.journal.entries("studio", before=500),
    "journal since a time": lambda all_: all_.journal.entries("studio", since=5.0),
    "journal of all": lambda all_: all_.journal.entries(None, before=500),
    "journal that is old": lambda all_: all_.journal.expire(5.0),
    "due": lambda all_: all_.deliveries.due(10),
}


@contextmanager
def plans() -> Iterator[list[str]]:
    """What SQLite says of each step of each statement that reads, while the block lasts."""
    steps: list[str] = []

    def explain(
        connection: Connection, cursor: object, statement: str, parameters: object, *_: object
    ) -> None:
        if statement.startswith(("SELECT", "UPDATE", "DELETE")):
            raw = connection.connection.cursor()
            raw.execute(f"EXPLAIN QUERY PLAN {statement}", parameters)  # type: ignore[arg-type]
            steps.extend(row[3] for row in raw.fetchall())

    event.listen(Engine, "before_cursor_execute", explain)
    try:
        yield steps
    finally:
        event.remove(Engine, "before_cursor_execute", explain)


@pytest.mark.parametrize("name", CALLS)
def test_rows_are_found_by_an_index(database: Database, name: str) -> None:
    stores = Stores(database)
    with plans() as steps:
        CALLS[name](stores)
    assert steps
    assert not [
        step
        for step in steps
        if "TEMP B-TREE" in step or (step.startswith("SCAN") and not step.endswith(_SHORT))
    ]


_SHORT = (
    "CONSTANT ROW",  # the numbers of a list in the statement itself
    "(subquery-1)",
    "USING INDEX ix_assets_name",  # all assets in order, as far as the page goes
    "lines",  # of a limit or a page that shows places: a row for each tenant that ever had a job
)


def test_the_jobs_of_an_asset_are_sorted_but_no_others_read(database: Database) -> None:
    stores = Stores(database)
    for tenant in (None, "studio"):
        with plans() as steps:
            stores.listed(tenant, asset_id=stores.asset_id)
        assert "SEARCH jobs USING INDEX ix_jobs_asset (asset_number=?)" in steps


def test_all_jobs_are_listed_from_the_newest_on(database: Database) -> None:
    stores = Stores(database)
    for states in (frozenset[JobState](), ENDED):
        with plans() as steps:
            stores.listed(None, states=states)
        assert "SCAN jobs" in steps  # by number, until the page is full
        assert "USE TEMP B-TREE FOR ORDER BY" not in steps


def test_counts_read_an_index_alone(database: Database) -> None:
    stores = Stores(database)
    with plans() as steps:
        stores.jobs.counts()
    assert steps[0] == "SEARCH jobs USING COVERING INDEX ix_jobs_state (state=?)"
    assert steps[-1] == "SCAN lines"
