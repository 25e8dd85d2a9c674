"""How all assets of a tenant stand: queries for thousands of them at once.

Each takes the few numbers that it needs out of the stored summaries, and as many runs of an asset
as it shows, by the index of an asset's runs: its cost follows what is shown, not what is stored.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from sqlalchemy import ColumnElement, Row, ScalarSelect, Select, String, func, select, true
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import aliased
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import GenericFunction

from service.jobs.asset import FailedUpload, RunNumbers, Standing, Thresholds, demanded
from service.jobs.job import THUMBNAIL, Failure, JobKind, JobState
from service.storage.rows import NO_RUNS, is_run
from service.storage.tables import AssetRow, JobFileRow, JobRow, JournalRow


class json_list(GenericFunction[str]):
    """The values of a column as an array of JSON, in text, in the order of the rows."""

    type = String()
    inherit_cache = True


@compiles(json_list, "sqlite")
def _of_sqlite(element: json_list, compiler: SQLCompiler, **options: Any) -> str:
    return f"json_group_array({compiler.process(element.clauses, **options)})"


@compiles(json_list, "postgresql")
def _of_postgresql(element: json_list, compiler: SQLCompiler, **options: Any) -> str:
    return f"coalesce(json_agg({compiler.process(element.clauses, **options)})::text, '[]')"


def all_standings(tenant: str, recalls: int) -> Select[Any]:
    """Rows for :func:`standing_of`, by name."""
    run = aliased(JobRow)
    last = (
        select(run.number, run.summary["recall"].as_float().label("recall"))
        .where(run.asset_number == AssetRow.number, is_run(run))
        .order_by(run.number.desc())
        .limit(recalls)
        .correlate(AssetRow)
        .subquery()
    )
    history = select(json_list(last.c.recall)).scalar_subquery()
    return (
        select(
            AssetRow.id,
            AssetRow.name,
            AssetRow.min_precision,
            AssetRow.min_recall,
            AssetRow.max_overhang,
            history.label("recalls"),
            *_numbers(),
        )
        .outerjoin(JobRow, JobRow.number == _latest())
        .where(AssetRow.tenant == tenant, AssetRow.goes.is_(None))
        .order_by(AssetRow.name)
    )


def standing_of(row: Row[Any], folders: Mapping[str, Thresholds]) -> Standing:
    """``folders``  what is demanded of those of its tenant."""
    newest_first = json.loads(row.recalls)
    own = Thresholds(row.min_precision, row.min_recall, row.max_overhang)
    return Standing(
        id=row.id,
        name=row.name,
        thresholds=own,
        demanded=demanded(own, row.name, folders),
        latest=None if row.job_id is None else numbers_of(row),
        recalls=tuple(recall for recall in reversed(newest_first) if recall is not None),
    )


def all_runs_at(tenant: str, moment: float) -> Select[Any]:
    """The id of each asset that had a run then, and what :func:`numbers_of` takes."""
    return (
        select(AssetRow.id, *_numbers())
        .join(JobRow, JobRow.number == _latest(moment))
        .where(AssetRow.tenant == tenant)
    )


def numbers_of(row: Row[Any]) -> RunNumbers:
    return RunNumbers(
        job_id=row.job_id,
        created=row.created,
        triangles=row.triangles,
        input_triangles=row.input_triangles,
        seconds=row.seconds,
        precision=row.precision,
        recall=row.recall,
        worst_recall=row.worst_recall,
        worst_view=row.worst_view,
        overhang=row.overhang,
        verdict=row.verdict,
        pictured=bool(row.pictured),
        evaluation=row.kind is JobKind.EVALUATION,
    )


_LOOKED_AT = 200
"""Failed jobs, the newest, among which those without an asset are found."""


def all_failed(tenant: str, since: float) -> list[Select[JobRow]]:
    """Queries for :func:`failed_upload_of`: jobs of assets, and those of none."""
    job, again = aliased(JobRow), aliased(JobRow)
    newest = (
        select(func.max(job.number))
        .where(
            job.asset_number == AssetRow.number,
            job.state.in_([JobState.SUCCEEDED, JobState.FAILED]),
            job.kind.not_in(NO_RUNS),
        )
        .correlate(AssetRow)
        .scalar_subquery()
    )
    of_assets = (
        select(JobRow)
        .join(AssetRow, JobRow.number == newest)
        .where(AssetRow.tenant == tenant, AssetRow.goes.is_(None))
        .where(JobRow.state == JobState.FAILED)
        .order_by(JobRow.number.desc())
    )
    latest = (
        select(JobRow.number)
        .where(JobRow.tenant == tenant, JobRow.state == JobState.FAILED)
        .order_by(JobRow.number.desc())
        .limit(_LOOKED_AT)
        .subquery()
    )
    retried = select(again.number).where(
        again.tenant == tenant, again.retry_of == JobRow.id, again.number > JobRow.number
    )
    of_none = (
        select(JobRow)
        .join(latest, JobRow.number == latest.c.number)
        .where(
            JobRow.asset_number.is_(None),
            JobRow.ended >= since,
            JobRow.kind != JobKind.TRADEOFF,
            ~retried.exists(),
        )
        .order_by(JobRow.number.desc())
    )
    return [of_assets, of_none]


def failed_upload_of(row: JobRow) -> FailedUpload:
    assert row.ended is not None, "a job that failed has ended"
    assert row.failure is not None, "and says why"
    return FailedUpload(
        job_id=row.id,
        name=row.name,
        asset_id=row.asset.id if row.asset else None,
        asset=row.asset.name if row.asset else None,
        ended=row.ended,
        failure=Failure(**row.failure),
    )


def change_stamp(tenant: str) -> Select[Any]:
    """One row that changes with the runs, what failed, the assets and what is demanded of them.

    Runs are counted in an index that covers them: milliseconds for a hundred thousand.
    """
    runs, failed = (
        select(func.count().label(f"{name}s"), func.max(JobRow.number).label(f"newest_{name}"))
        .where(JobRow.tenant == tenant, JobRow.state == state)
        .subquery()
        for name, state in (("run", JobState.SUCCEEDED), ("failure", JobState.FAILED))
    )
    assets = (
        select(func.count().label("assets"), func.count(AssetRow.goes).label("removed"))
        .where(AssetRow.tenant == tenant)
        .subquery()
    )
    # Which has an entry for each change of thresholds and names.
    journal = (
        select(func.max(JournalRow.number).label("newest_entry"))
        .where(JournalRow.tenant == tenant)
        .subquery()
    )
    joined = runs.join(failed, true()).join(assets, true()).join(journal, true())
    return select(runs, failed, assets, journal).select_from(joined)


def _latest(before: float | None = None) -> ScalarSelect[int]:
    """The number of an asset's latest run, or of the latest that was asked for before a time."""
    run = aliased(JobRow)
    query = (
        select(run.number)
        .where(run.asset_number == AssetRow.number, is_run(run))
        .order_by(run.number.desc())
        .limit(1)
    )
    if before is not None:
        query = query.where(run.created < before)
    return query.correlate(AssetRow).scalar_subquery()


def _numbers() -> tuple[ColumnElement[Any], ...]:
    summary = JobRow.summary
    whole = ("triangles", "input_triangles", "worst_view")
    shares = ("seconds", "precision", "recall", "worst_recall", "overhang")
    return (
        JobRow.id.label("job_id"),
        JobRow.created.label("created"),
        JobRow.kind.label("kind"),
        *(summary[name].as_integer().label(name) for name in whole),
        *(summary[name].as_float().label(name) for name in shares),
        summary["verdict"].as_string().label("verdict"),
        select(JobFileRow.name)
        .where(JobFileRow.job_number == JobRow.number, JobFileRow.name == THUMBNAIL)
        .exists()
        .label("pictured"),
    )
