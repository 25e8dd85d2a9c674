"""Progress that servers tell each other."""

from __future__ import annotations

import pytest

from service.jobs.progress import JobProgress, Snapshot
from service.storage.job_store import SqlJobStore
from service.storage.postgres import PostgresDatabase
from service.storage.progress_store import SqlProgressStore
from tests.service.storage.samples import DIED, results, submission, summary

FAR = JobProgress("refine", 0.5, 0.25, 1, 3, 12.0, Snapshot(4, b"\x89PNG"))


@pytest.fixture
def progress(postgres_database: PostgresDatabase) -> SqlProgressStore:
    return SqlProgressStore(postgres_database)


def test_the_latest_is_read_of_those_that_were_asked_for(progress: SqlProgressStore) -> None:
    near = JobProgress("voxelize", 0.1)
    progress.write({"a": near, "b": near, "c": near})
    progress.write({"a": FAR})
    assert progress.read(["a", "b", "none"]) == {"a": FAR, "b": near}


@pytest.mark.parametrize("how", ["succeed", "fail", "put off"])
def test_it_goes_with_its_attempt(
    progress: SqlProgressStore, postgres_database: PostgresDatabase, how: str
) -> None:
    jobs = SqlJobStore(postgres_database)
    jobs.submit(submission(), 10)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    progress.write({claim.job.id: FAR})
    match how:
        case "succeed":
            jobs.succeed(claim, results(), summary())
        case "fail":
            jobs.fail(claim, DIED, final=False)
        case _:
            jobs.put_off(claim, DIED)
    assert progress.read([claim.job.id]) == {}


def test_it_is_written_without_a_flush(postgres_database: PostgresDatabase) -> None:
    from sqlalchemy import text

    with postgres_database.reading() as session:
        kinds = session.execute(
            text(
                "SELECT relname, relpersistence FROM pg_class"
                " WHERE relname IN ('progress', 'failed_sign_ins', 'jobs') ORDER BY relname"
            )
        ).all()
    assert [tuple(one) for one in kinds] == [
        ("failed_sign_ins", "u"), ("jobs", "p"), ("progress", "u"),
    ]  # fmt: skip
