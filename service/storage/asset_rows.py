"""Rows of assets: found, made, and read together with what their runs say."""

from __future__ import annotations

from sqlalchemy import ColumnElement, Select, and_, func, select
from sqlalchemy.orm import Session, aliased

from service.jobs.asset import Asset, Thresholds
from service.jobs.job import JobKind, JobState
from service.storage.rows import job_of, new_id
from service.storage.tables import AssetRow, JobRow


def asset_named(session: Session, tenant: str, name: str) -> AssetRow | None:
    query = select(AssetRow).where(AssetRow.tenant == tenant, AssetRow.name == name)
    return session.scalars(query).first()


def add_asset(session: Session, tenant: str, name: str, now: float) -> AssetRow:
    row = AssetRow(id=new_id(), tenant=tenant, name=name, folded=name.casefold(), created=now)
    session.add(row)
    session.flush()
    return row


def is_run(job: type[JobRow]) -> ColumnElement[bool]:
    """Whether a job is a run of its asset, as :class:`~service.jobs.asset.AssetStore` says."""
    return and_(job.state == JobState.SUCCEEDED, job.kind != JobKind.TRADEOFF)


def with_runs(tenant: str | None) -> Select[AssetRow, JobRow | None, int]:
    """Assets, the latest of the runs of each, and how many they are."""
    run = aliased(JobRow)
    runs_of_it = (run.asset_number == AssetRow.number, is_run(run))
    newest = select(func.max(run.number)).where(*runs_of_it).scalar_subquery()
    count = select(func.count()).select_from(run).where(*runs_of_it).scalar_subquery()
    query = select(AssetRow, JobRow, count).outerjoin(JobRow, JobRow.number == newest)
    return query if tenant is None else query.where(AssetRow.tenant == tenant)


def asset_of(row: AssetRow, latest: JobRow | None, runs: int) -> Asset:
    return Asset(
        id=row.id,
        tenant=row.tenant,
        name=row.name,
        created=row.created,
        thresholds=Thresholds(row.min_precision, row.min_recall),
        runs=runs,
        latest=None if latest is None else job_of(latest),
    )
