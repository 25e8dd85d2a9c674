"""What the page of an asset shows, from real stores and without a browser."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from service.dashboard.asset.details import (
    AssetDetail,
    RunDetail,
    chosen_options,
    read_asset,
    read_run,
)
from service.errors import NotFoundError
from service.jobs.asset import Thresholds
from service.jobs.job import Failure, JobKind
from service.schemas.job_options import option_tables
from tests.service.dashboard.results import JobResult
from tests.service.dashboard.stock import TENANT, Stock, stocked


@pytest.fixture
def stock(tmp_path: Path) -> Iterator[Stock]:
    with stocked(tmp_path / "data") as opened:
        yield opened


def _read(stock: Stock, asset_id: str, job_id: str | None = None) -> AssetDetail:
    return read_asset(stock, TENANT, asset_id, job_id)


def test_a_run_has_everything_that_its_job_has_made(stock: Stock, castle: JobResult) -> None:
    run = read_run(stock, TENANT, stock.run(castle).id)
    assert [level.level for level in run.levels] == [0, 1]
    assert run.levels[0].files["glb"] == f"/v1/jobs/{run.job.id}/files/lod0.glb"
    assert run.levels[1].switch_distance > run.levels[0].switch_distance > 0.0
    assert run.original == f"/v1/jobs/{run.job.id}/files/original.glb"
    assert run.sheet == f"/v1/jobs/{run.job.id}/files/pictures/silhouettes.png"
    assert len(run.views) == 64
    assert run.views[castle.summary.worst_view or 0].recall == castle.summary.worst_recall
    assert run.solid is not None
    assert run.solid.closed_by[0][0] == "ground"
    assert 0.0 < (run.deviation or 0.0) <= (castle.summary.error_bound or 0.0)


def test_pages_that_nobody_has_asked_for_are_shown_too(
    stock: Stock, castle: JobResult, tmp_path: Path
) -> None:
    whole = read_run(stock, TENANT, stock.run(castle).id)
    assert [one.name for one in whole.later] == ["loss.json"]  # which is always made when asked for
    undrawn = shutil.copytree(
        castle.folder,
        tmp_path / "undrawn",
        ignore=shutil.ignore_patterns("report.html", "pictures"),
    )
    run = read_run(stock, TENANT, stock.run(replace(castle, folder=undrawn)).id)
    place = f"/v1/jobs/{run.job.id}/files"
    assert run.sheet == f"{place}/pictures/silhouettes.png"
    assert {one.name: one.link for one in run.later} == {
        name: f"{place}/{name}"
        for name in ("report.html", "pictures/silhouettes.png", "pictures/recall.png",
                     "pictures/precision.png", "loss.json")
    }  # fmt: skip


def test_a_run_that_has_kept_little_has_everything_still(
    stock: Stock, castle: JobResult, tmp_path: Path
) -> None:
    lean = tmp_path / "lean"
    lean.mkdir()
    for name in ("occluder.glb", "report.json"):
        shutil.copyfile(castle.folder / name, lean / name)
    (lean / "levels.npz").write_bytes(b"its levels")
    run = read_run(stock, TENANT, stock.run(replace(castle, folder=lean)).id)
    whole = read_run(stock, TENANT, stock.run(castle).id)

    def told(one: RunDetail) -> object:
        """But for the job's own id."""
        links = [one.original, one.sheet, *(level.files for level in one.levels)]
        return json.dumps(links).replace(one.job.id, "id")

    assert told(run) == told(whole)
    pictures = {file.name for file in whole.files if file.name.startswith("pictures/view_")}
    shown = {*pictures, "thumbnail.png"}  # which lists do without where little is kept
    assert {one.name for one in (*whole.files, *whole.later)} - shown == {
        one.name for one in (*run.files, *run.later)
    } - {"levels.npz"}


def test_a_job_that_failed_has_nothing_but_its_inputs(stock: Stock, castle: JobResult) -> None:
    job = stock.failure(castle, Failure("out-of-time", "it took longer than 10 s", "give it more"))
    run = read_run(stock, TENANT, job.id)
    assert (run.levels, run.views, run.solid, run.original) == ((), (), None, None)
    assert [file.name for file in run.files] == ["input/mesh.ply"]


def test_an_asset_shows_its_latest_run_or_the_one_asked_for(
    stock: Stock, castle: JobResult
) -> None:
    first, second = (stock.run(castle, asset="props/castle") for _ in range(2))
    asset_id = stock.demand("props/castle", Thresholds(min_recall=0.5))
    detail = _read(stock, asset_id)
    assert detail.run is not None
    assert detail.run.job.id == second.id
    assert [line.job_id for line in detail.history] == [second.id, first.id]
    asked = _read(stock, asset_id, first.id)
    assert asked.run is not None
    assert asked.run.job.id == first.id


def test_history_says_whether_each_run_holds_by_the_thresholds_of_today(
    stock: Stock, castle: JobResult
) -> None:
    stock.run(castle, asset="props/castle", recall=0.4)
    stock.run(castle, asset="props/castle", recall=0.9)
    asset_id = stock.demand("props/castle", Thresholds(min_recall=0.5))
    assert [line.holds for line in _read(stock, asset_id).history] == [True, False]
    stock.demand("props/castle", Thresholds())
    assert [line.holds for line in _read(stock, asset_id).history] == [None, None]


def test_an_asset_without_a_run_has_no_detail(stock: Stock) -> None:
    detail = _read(stock, stock.demand("props/new", Thresholds()))
    assert detail.run is None
    assert detail.history == ()


def test_what_another_tenant_has_is_not_there(stock: Stock, castle: JobResult) -> None:
    job = stock.run(castle, asset="props/castle")
    with pytest.raises(NotFoundError):
        read_run(stock, "another", job.id)
    with pytest.raises(NotFoundError):
        read_asset(stock, "another", stock.demand("props/castle", Thresholds()))


def test_options_are_told_where_they_are_not_as_by_default() -> None:
    table = option_tables(60.0, 1e9)[JobKind.OCCLUDER]
    assert chosen_options(table, table.read({})) == "defaults"
    chosen = chosen_options(table, table.read({"budget": 32, "ground": True, "lods": 1}))
    assert set(chosen.split(", ")) == {"budget 32", "ground on", "lods 1"}
