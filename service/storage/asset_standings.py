"""How all assets of a tenant stand: queries for thousands of them at once.

Each takes the few numbers that it needs out of the stored summaries, and as many runs of an asset
as it shows, by the index of an asset's runs: its cost follows what is shown, not what is stored.
"""

from __future__ import annotations

import json
from typing import Any

from sqlalchemy import ColumnElement, Row, ScalarSelect, Select, String, func, select, true
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import aliased
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import GenericFunction

from service.jobs.asset import RunNumbers, Standing, Thresholds
from service.jobs.job import JobState
from service.storage.rows import is_run
from service.storage.tables import AssetRow, JobRow


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
        .where(AssetRow.tenant == tenant)
        .order_by(AssetRow.name)
    )


def standing_of(row: Row[Any]) -> Standing:
    newest_first = json.loads(row.recalls)
    return Standing(
        id=row.id,
        name=row.name,
        thresholds=Thresholds(row.min_precision, row.min_recall, row.max_overhang),
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
    )


def change_stamp(tenant: str) -> Select[Any]:
    """One row that changes with the runs, the assets and what is demanded of them.

    Runs are counted in an index that covers them: milliseconds for a hundred thousand.
    """
    runs = (
        select(func.count().label("runs"), func.max(JobRow.number).label("newest"))
        .where(JobRow.tenant == tenant, JobRow.state == JobState.SUCCEEDED)
        .subquery()
    )
    assets = (
        select(
            func.count().label("assets"),
            func.sum(AssetRow.min_precision * AssetRow.number).label("precisions"),
            func.sum(AssetRow.min_recall * AssetRow.number).label("recalls"),
            func.sum(AssetRow.max_overhang * AssetRow.number).label("overhangs"),
            func.count(AssetRow.min_precision).label("with_precision"),
            func.count(AssetRow.min_recall).label("with_recall"),
            func.count(AssetRow.max_overhang).label("with_overhang"),
        )
        .where(AssetRow.tenant == tenant)
        .subquery()
    )
    return select(runs, assets).select_from(runs.join(assets, true()))


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
        *(summary[name].as_integer().label(name) for name in whole),
        *(summary[name].as_float().label(name) for name in shares),
        summary["verdict"].as_string().label("verdict"),
    )
