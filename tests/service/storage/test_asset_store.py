"""Assets: their names, their runs, and what is demanded of them."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from service.errors import BadRequestError, ConflictError, NotFoundError
from service.jobs.asset import Thresholds
from service.jobs.job import Job, JobKind
from service.storage.asset_store import SqlAssetStore
from service.storage.database import Database
from service.storage.job_store import SqlJobStore
from service.storage.journal_store import SqlJournal
from tests.service.storage.samples import DIED, Clock, results, submission, summary


def run(
    jobs: SqlJobStore,
    asset: str,
    recall: float = 0.9,
    tenant: str = "studio",
    kind: JobKind = JobKind.OCCLUDER,
) -> Job:
    """A job of an asset that was done."""
    asked = submission(asset=asset, tenant=tenant, kind=kind, may_reuse=False)
    jobs.submit(asked, 100)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    assert jobs.succeed(claim, results(), summary(recall))
    return jobs.job(None, claim.job.id)


def test_an_asset_is_made_with_its_first_job(jobs: SqlJobStore, assets: SqlAssetStore) -> None:
    job, _ = jobs.submit(submission(asset="props/castle"), 10)
    assert job.asset == "props/castle"
    assert job.asset_id is not None
    asset = assets.asset("studio", job.asset_id)
    assert (asset.name, asset.runs, asset.latest) == ("props/castle", 0, None)


def test_the_latest_run_is_the_last_that_succeeded(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    run(jobs, "castle", 0.8)
    latest = run(jobs, "castle", 0.85)
    jobs.submit(submission("poison", asset="castle"), 10)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    jobs.fail(claim, DIED, final=True)
    jobs.submit(submission("waits", asset="castle"), 10)
    (asset,) = assets.assets("studio").assets
    assert (asset.runs, asset.latest) == (2, latest)
    assert asset.latest
    assert asset.latest.summary == summary(0.85)


def test_a_result_that_was_stored_already_is_a_run(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    first = run(jobs, "castle")
    again, _ = jobs.submit(submission(asset="castle"), 10)
    assert again.reused == first.id
    (asset,) = assets.assets("studio").assets
    assert (asset.runs, asset.latest) == (2, again)


def test_runs_are_paged_newest_first(jobs: SqlJobStore, assets: SqlAssetStore) -> None:
    done = [run(jobs, "castle", 0.8 + share / 100) for share in range(5)]
    run(jobs, "another")
    asset_id = done[0].asset_id
    assert asset_id is not None
    first = assets.runs("studio", asset_id, limit=3)
    assert first.runs == tuple(done[:1:-1])
    second = assets.runs("studio", asset_id, before=first.cursor, limit=3)
    assert (second.runs, second.cursor) == (tuple(done[1::-1]), None)


def test_assets_are_paged_by_name_across_tenants(assets: SqlAssetStore) -> None:
    names = ["b", "a/1", "ä", "a", "Z: 1"]
    for tenant in ("rival", "studio"):
        for name in names:
            assets.put(tenant, name, Thresholds())

    def pages(tenant: str | None) -> list[str]:
        seen: list[str] = []
        after = None
        while True:
            page = assets.assets(tenant, after=after, limit=3)
            seen += [asset.name for asset in page.assets]
            after = page.cursor
            if after is None:
                return seen

    assert pages("studio") == sorted(names)
    assert pages(None) == sorted(names * 2)


def test_what_is_no_cursor_is_told(assets: SqlAssetStore) -> None:
    with pytest.raises(BadRequestError, match="'castle' is no cursor"):
        assets.assets("studio", after="castle")


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    names=st.sets(st.text(st.sampled_from("aAßéÉ%_/"), min_size=1, max_size=5), max_size=6),
    part=st.text(st.sampled_from("aAßséÉ%_/"), max_size=2),
)
def test_names_are_searched_whatever_their_case(
    database: Database, names: set[str], part: str
) -> None:
    assets = SqlAssetStore(database)
    tenant = "/".join(sorted(names))
    for name in names:
        assets.put(tenant, name, Thresholds())
    found = [asset.name for asset in assets.assets(tenant, contains=part).assets]
    assert found == sorted(name for name in names if part.casefold() in name.casefold())
    for name in names:
        assert [one.name for one in assets.assets(tenant, name=name).assets] == [name]


def test_thresholds_are_set_and_changed(assets: SqlAssetStore) -> None:
    asset, made = assets.put("studio", "castle", Thresholds(min_recall=0.8))
    assert made
    again, made = assets.put("studio", "castle", Thresholds(0.99, 0.9))
    assert not made
    assert (again.id, again.thresholds) == (asset.id, Thresholds(0.99, 0.9))
    assert assets.set_thresholds("studio", asset.id, Thresholds()).thresholds == Thresholds()
    assert assets.asset("studio", asset.id).thresholds == Thresholds()


def test_an_asset_goes_with_its_jobs(jobs: SqlJobStore, assets: SqlAssetStore) -> None:
    job = run(jobs, "castle")
    kept = run(jobs, "tower")
    assert job.asset_id is not None
    assets.remove("studio", job.asset_id)
    for call in (lambda: assets.asset(None, str(job.asset_id)), lambda: jobs.job(None, job.id)):
        with pytest.raises(NotFoundError):
            call()
    assert jobs.job(None, kept.id) == kept


def test_an_asset_stays_while_a_job_of_it_has_not_ended(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    job, _ = jobs.submit(submission(asset="castle"), 10)
    assert job.asset_id is not None
    for _ in ("queued", "running"):
        with pytest.raises(ConflictError, match=job.id):
            assets.remove("studio", job.asset_id)
        jobs.claim("one", 30.0)
    assert assets.asset("studio", job.asset_id).runs == 0


def test_another_tenant_sees_nothing(jobs: SqlJobStore, assets: SqlAssetStore) -> None:
    asset, _ = assets.put("studio", "castle", Thresholds(min_recall=0.8))
    for call in (
        lambda: assets.asset("rival", asset.id),
        lambda: assets.runs("rival", asset.id),
        lambda: assets.set_thresholds("rival", asset.id, Thresholds()),
        lambda: assets.remove("rival", asset.id),
    ):
        with pytest.raises(NotFoundError, match=asset.id):
            call()
    assert assets.assets("rival").assets == ()
    theirs = run(jobs, "castle", tenant="rival")
    assert theirs.asset_id != asset.id
    assert assets.asset(None, asset.id) == asset


@pytest.mark.parametrize("kind", [JobKind.TRADEOFF, JobKind.VISIBILITY])
def test_neither_a_tradeoff_nor_visible_sets_are_a_run(
    jobs: SqlJobStore, assets: SqlAssetStore, kind: JobKind
) -> None:
    latest = run(jobs, "castle", 0.8)
    swept = run(jobs, "castle", 0.1, kind=kind)
    (asset,) = assets.assets("studio").assets
    assert (asset.runs, asset.latest) == (1, latest)
    assert assets.runs("studio", asset.id).runs == (latest,)
    assert swept.ended is not None
    assert jobs.expire(swept.ended + 1.0) == 1  # the run stays, since it is the latest
    assert assets.asset("studio", asset.id).latest == latest


def named(assets: SqlAssetStore, name: str) -> str:
    return assets.put("studio", name, Thresholds())[0].id


def test_what_an_asset_does_not_set_is_that_of_the_nearest_folder(assets: SqlAssetStore) -> None:
    assets.set_folder_thresholds("studio", "", Thresholds(0.99, 0.5, 0.01))
    assets.set_folder_thresholds("studio", "props", Thresholds(min_recall=0.7))
    assets.set_folder_thresholds("studio", "props/tiny", Thresholds(min_recall=0.2))
    assets.set_folder_thresholds("rival", "", Thresholds(1.0, 1.0, 0.0))
    for name, recall in (("props/gate", 0.7), ("props/tiny/cup", 0.2), ("propsy", 0.5)):
        asset = assets.asset("studio", named(assets, name))
        assert asset.thresholds == Thresholds()
        assert asset.demanded == Thresholds(0.99, recall, 0.01)
    own, _ = assets.put("studio", "props/tiny/cup", Thresholds(min_recall=0.9))
    assert own.demanded == Thresholds(0.99, 0.9, 0.01)
    listed = {one.name: one.demanded for one in assets.standings("studio")}
    assert listed == {one.name: one.demanded for one in assets.assets(None).assets}
    assert listed["props/tiny/cup"] == own.demanded


def test_a_folder_without_thresholds_is_not_kept(
    assets: SqlAssetStore, journal: SqlJournal
) -> None:
    assets.set_folder_thresholds("studio", "props", Thresholds(min_recall=0.7))
    assets.set_folder_thresholds("studio", "props", Thresholds(min_recall=0.7))
    assert assets.folder_thresholds("studio") == {"props": Thresholds(min_recall=0.7)}
    assets.set_folder_thresholds("studio", "props", Thresholds())
    assets.set_folder_thresholds("studio", "props", Thresholds())
    assert assets.folder_thresholds("studio") == {}
    told = [entry.details["after"]["min_recall"] for entry in journal.entries("studio").entries]
    assert told == [None, 0.7]


def test_an_asset_keeps_its_runs_under_another_name(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    job = run(jobs, "castle")
    assert job.asset_id is not None
    renamed = assets.rename("studio", job.asset_id, "props/Castle")
    assert (renamed.id, renamed.name, renamed.latest and renamed.latest.id) == (
        job.asset_id, "props/Castle", job.id,
    )  # fmt: skip
    assert jobs.job("studio", job.id).asset == "props/Castle"
    assert [one.name for one in assets.assets("studio", contains="props/c").assets] == [
        "props/Castle"
    ]
    assert run(jobs, "castle").asset_id != job.asset_id


def test_a_name_that_another_asset_has_is_refused(assets: SqlAssetStore) -> None:
    named(assets, "gate")
    castle = named(assets, "castle")
    with pytest.raises(ConflictError, match="there is an asset 'gate' already"):
        assets.rename("studio", castle, "gate")
    assert assets.rename("studio", castle, "castle").name == "castle"
    with pytest.raises(NotFoundError):
        assets.rename("rival", castle, "gate")


def test_what_was_removed_can_be_restored_until_it_goes(
    jobs: SqlJobStore, assets: SqlAssetStore, clock: Clock
) -> None:
    job = run(jobs, "castle")
    assert job.asset_id is not None
    before = assets.stamp("studio")
    assets.remove_later("studio", job.asset_id, clock.now + 60.0)
    assert assets.standings("studio") == ()
    assert assets.assets("studio").assets == ()
    assert assets.stamp("studio") != before
    assert [(one.name, one.goes) for one in assets.removed("studio")] == [
        ("castle", clock.now + 60.0)
    ]
    assert assets.removed("rival") == ()
    with pytest.raises(ConflictError, match="was removed, and can still be restored"):
        assets.rename("studio", named(assets, "gate"), "castle")
    assert assets.remove_due(clock.now + 59.0) == 0
    restored = assets.restore("studio", job.asset_id)
    assert (restored.goes, restored.latest and restored.latest.id) == (None, job.id)
    assert assets.remove_due(clock.now + 61.0) == 0
    assets.remove_later("studio", job.asset_id, clock.now + 60.0)
    assert assets.remove_due(clock.now + 60.0) == 1
    with pytest.raises(NotFoundError):
        jobs.job("studio", job.id)


def test_a_new_run_restores_what_was_removed(
    jobs: SqlJobStore, assets: SqlAssetStore, clock: Clock
) -> None:
    job = run(jobs, "castle")
    assert job.asset_id is not None
    assets.remove_later("studio", job.asset_id, clock.now)
    assert run(jobs, "castle").asset_id == job.asset_id
    assert assets.remove_due(clock.now) == 0
    assert assets.asset("studio", job.asset_id).runs == 2


def test_what_goes_waits_for_its_jobs(
    jobs: SqlJobStore, assets: SqlAssetStore, clock: Clock
) -> None:
    job, _ = jobs.submit(submission(asset="castle"), 10)
    assert job.asset_id is not None
    assets.remove_later("studio", job.asset_id, clock.now)
    assert assets.remove_due(clock.now) == 0
    jobs.cancel("studio", job.id)
    assert assets.remove_due(clock.now) == 1


def fail(jobs: SqlJobStore, **changes: Any) -> str:
    jobs.submit(submission(str(changes), **changes), 100)
    claim = jobs.claim("one", 30.0)
    assert claim is not None
    jobs.fail(claim, DIED, final=True)
    return claim.job.id


def test_an_upload_has_failed_until_a_later_one_succeeds(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    fail(jobs, asset="castle", name="old.glb")
    newest = fail(jobs, asset="castle", name="new.glb")
    (found,) = assets.failed("studio", 0.0)
    assert (found.job_id, found.name, found.asset, found.failure) == (
        newest, "new.glb", "castle", DIED,
    )  # fmt: skip
    assert assets.failed("rival", 0.0) == ()
    run(jobs, "castle")
    assert assets.failed("studio", 0.0) == ()


def test_of_what_is_no_asset_the_latest_failures_are_told(
    jobs: SqlJobStore, assets: SqlAssetStore, clock: Clock
) -> None:
    first = fail(jobs, name="a.glb")
    assert [one.job_id for one in assets.failed("studio", clock.now)] == [first]
    assert assets.failed("studio", clock.now + 1.0) == ()
    again = submission("again", name="a.glb", retry_of=first)
    jobs.submit(again, 100)
    assert assets.failed("studio", clock.now) == ()


def test_the_stamp_changes_with_all_that_lists_show(
    jobs: SqlJobStore, assets: SqlAssetStore
) -> None:
    job = run(jobs, "castle")
    assert job.asset_id is not None
    stamps = [assets.stamp("studio")]
    changes = (
        lambda: assets.set_thresholds("studio", job.asset_id, Thresholds(min_recall=0.5)),
        lambda: assets.set_folder_thresholds("studio", "", Thresholds(min_recall=0.5)),
        lambda: assets.rename("studio", job.asset_id, "tower"),
        lambda: fail(jobs, asset="tower"),
        lambda: run(jobs, "tower"),
        lambda: named(assets, "gate"),
    )
    for change in changes:
        change()
        stamps.append(assets.stamp("studio"))
    assert len(set(stamps)) == len(stamps)
    assert assets.stamp("studio") == stamps[-1]
