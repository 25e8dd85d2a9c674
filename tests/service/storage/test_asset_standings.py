"""How all assets stand, by few queries."""

from __future__ import annotations

from dataclasses import replace

import pytest
from sqlalchemy import select

from service.jobs.asset import Thresholds
from service.jobs.job import JobState
from service.storage.asset_store import SqlAssetStore
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.tables import JobRow
from tests.service.storage.samples import DIED, Clock, results, submission, summary


class Runs:
    """Makes runs of assets, one after the other."""

    def __init__(self, jobs: SqlJobStore) -> None:
        self._jobs = jobs
        self._count = 0

    def make(self, asset: str, recall: float, tenant: str = "studio") -> str:
        self._count += 1
        wanted = submission(f"mesh {self._count}", asset=asset, tenant=tenant)
        job, _ = self._jobs.submit(wanted, 10)
        claim = self._jobs.claim("one", 30.0)
        assert claim is not None
        assert self._jobs.succeed(claim, results(f"of {self._count}"), summary(recall))
        return job.id


@pytest.fixture
def runs(jobs: SqlJobStore) -> Runs:
    return Runs(jobs)


def test_an_asset_stands_by_its_latest_run(assets: SqlAssetStore, runs: Runs) -> None:
    runs.make("castle", 0.7)
    newest = runs.make("castle", 0.9)
    (castle,) = assets.standings("studio")
    assert castle.name == "castle"
    assert castle.latest is not None
    assert (castle.latest.job_id, castle.latest.recall) == (newest, 0.9)
    assert (castle.latest.triangles, castle.latest.input_triangles) == (64, 5000)
    assert castle.recalls == (0.7, 0.9)


def test_its_history_ends_with_the_latest_and_is_no_longer_than_asked(
    assets: SqlAssetStore, runs: Runs
) -> None:
    for recall in (0.1, 0.2, 0.3, 0.4):
        runs.make("castle", recall)
    (castle,) = assets.standings("studio", recalls=3)
    assert castle.recalls == (0.2, 0.3, 0.4)


def test_overhang_and_verdict_stand_where_a_run_has_them(
    assets: SqlAssetStore, jobs: SqlJobStore, database: Database
) -> None:
    """Summaries that were stored before they were kept have no such member."""
    job, _ = jobs.submit(submission("mesh", asset="castle", tenant="studio"), 10)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    told = replace(summary(0.7), overhang=0.0042, verdict="weak")
    assert jobs.succeed(claim, results("of it"), told)
    stored = jobs.job("studio", job.id).summary
    assert stored is not None
    assert (stored.overhang, stored.verdict) == (0.0042, "weak")
    (castle,) = assets.standings("studio")
    assert castle.latest is not None
    assert (castle.latest.overhang, castle.latest.verdict) == (0.0042, "weak")
    with database.writing() as session:
        row = session.scalars(select(JobRow)).one()
        later = {"overhang", "verdict", "reason", "try_next"}
        row.summary = {name: one for name, one in (row.summary or {}).items() if name not in later}
    (castle,) = assets.standings("studio")
    assert castle.latest is not None
    assert (castle.latest.recall, castle.latest.overhang, castle.latest.verdict) == (
        0.7,
        None,
        None,
    )
    old = jobs.job("studio", job.id).summary
    assert old is not None
    assert (old.recall, old.overhang, old.verdict) == (0.7, None, None)


def test_what_is_demanded_of_overhang_changes_the_stamp(assets: SqlAssetStore) -> None:
    castle, _ = assets.put("studio", "castle", Thresholds(0.9, 0.5))
    before = assets.stamp("studio")
    found = assets.set_thresholds("studio", castle.id, Thresholds(0.9, 0.5, 0.01))
    assert (
        found.thresholds == assets.standings("studio")[0].thresholds == Thresholds(0.9, 0.5, 0.01)
    )
    assert assets.stamp("studio") != before


def test_an_asset_without_runs_stands_there_too(assets: SqlAssetStore) -> None:
    assets.put("studio", "never", Thresholds(0.9, 0.5))
    (never,) = assets.standings("studio")
    assert (never.latest, never.recalls) == (None, ())
    assert never.thresholds == Thresholds(0.9, 0.5)


def test_jobs_that_failed_are_no_runs(assets: SqlAssetStore, jobs: SqlJobStore, runs: Runs) -> None:
    runs.make("castle", 0.9)
    jobs.submit(submission("broken", asset="castle"), 10)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    assert jobs.fail(claim, DIED, final=True) is JobState.FAILED
    (castle,) = assets.standings("studio")
    assert castle.recalls == (0.9,)


def test_others_assets_do_not_show(assets: SqlAssetStore, runs: Runs) -> None:
    runs.make("castle", 0.9)
    runs.make("castle", 0.1, tenant="other")
    assert [one.recalls for one in assets.standings("studio")] == [(0.9,)]
    assert len(assets.runs_at("other", 2e9)) == 1


def test_what_was_the_latest_at_a_time(assets: SqlAssetStore, runs: Runs, clock: Clock) -> None:
    old = runs.make("castle", 0.7)
    clock.now += 100.0
    runs.make("castle", 0.9)
    runs.make("tower", 0.9)
    (castle, _) = assets.standings("studio")
    then = assets.runs_at("studio", clock.now)
    assert {key: run.job_id for key, run in then.items()} == {castle.id: old}


def test_the_stamp_changes_with_whatever_is_shown(assets: SqlAssetStore, runs: Runs) -> None:
    seen = [assets.stamp("studio")]

    def changed() -> bool:
        seen.append(assets.stamp("studio"))
        return seen[-1] not in seen[:-1]

    runs.make("castle", 0.9)
    assert changed()
    runs.make("castle", 0.9)
    assert changed()
    tower, _ = assets.put("studio", "tower", Thresholds())
    assert changed()
    assets.set_thresholds("studio", tower.id, Thresholds(0.0, None))
    assert changed()
    assets.set_thresholds("studio", tower.id, Thresholds(0.9, 0.5))
    assert changed()


def test_the_stamp_stays_while_nothing_of_ones_own_changes(
    assets: SqlAssetStore, jobs: SqlJobStore, runs: Runs
) -> None:
    runs.make("castle", 0.9)
    before = assets.stamp("studio")
    runs.make("castle", 0.9, tenant="other")
    jobs.submit(submission("waiting", asset="castle"), 10)
    assert assets.stamp("studio") == before
