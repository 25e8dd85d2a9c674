"""Each job that has ended is counted once, whoever asks and however often."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from service.jobs.tallies import Tally
from service.storage import tally_store
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.tally_store import SqlTallies
from tests.service.storage.samples import DIED, results, submission, summary


def end(jobs: SqlJobStore, text: str, *, fails: bool = False) -> None:
    jobs.submit(submission(text), 1000)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    if fails:
        jobs.fail(claim, DIED, final=True)
    else:
        jobs.succeed(claim, results(text), summary())


def test_ends_failures_and_seconds_are_counted(jobs: SqlJobStore, database: Database) -> None:
    tallies = SqlTallies(database)
    assert tallies.totals() == {}
    end(jobs, "a")
    end(jobs, "b", fails=True)
    jobs.submit(submission("waits"), 10)
    jobs.submit(submission("a"), 10)  # a stored result
    expected = {
        ("ended", "occluder", "succeeded"): Tally(2),
        ("ended", "occluder", "failed"): Tally(1),
        ("failed", "process-died"): Tally(1),
        ("seconds", "occluder", "all", "3.0"): Tally(1, 1.5),
        ("seconds", "occluder", "refine", "1.0"): Tally(1, 1.0),
        ("seconds", "occluder", "voxelize", "0.3"): Tally(1, 0.25),
    }
    assert tallies.totals() == expected
    assert SqlTallies(database).totals() == expected  # as after a restart


def test_what_was_counted_stays_when_its_job_is_forgotten(
    jobs: SqlJobStore, database: Database
) -> None:
    end(jobs, "a")
    before = SqlTallies(database).totals()
    assert jobs.expire(9e9) == 1
    assert SqlTallies(database).totals() == before


def test_many_who_ask_at_once_count_each_job_once(
    jobs: SqlJobStore, database: Database, monkeypatch
) -> None:
    monkeypatch.setattr(tally_store, "_AT_ONCE", 7)
    for number in range(24):
        end(jobs, str(number), fails=number % 4 == 0)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: SqlTallies(database).totals(), range(8)))
    totals = SqlTallies(database).totals()
    assert totals["ended", "occluder", "succeeded"].count == 18
    assert totals["failed", "process-died"].count == 6
    assert totals["seconds", "occluder", "all", "3.0"] == Tally(18, 27.0)
