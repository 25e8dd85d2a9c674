"""Rows of jobs, files and assets: found, listed, made, and turned into values."""

from __future__ import annotations

import secrets
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, fields
from typing import Any

from sqlalchemy import ColumnElement, ScalarSelect, Select, and_, func, select
from sqlalchemy.orm import Session, aliased

from service.jobs.asset import Asset, Thresholds, demanded
from service.jobs.job import Blob, Failure, Job, JobFile, JobKind, JobState, Submission, Summary
from service.jobs.stores import JobFilter
from service.storage.database import UndoneError, dialect_insert
from service.storage.tables import AssetRow, Base, FolderRow, JobFileRow, JobRow


def new_id() -> str:
    """128 random bits: nobody comes upon another's by trying."""
    return secrets.token_hex(16)


def by_name(row: Base, kind: type[Any], *, but: Collection[str] = ()) -> dict[str, Any]:
    """What a row has in columns that are named as the fields of a dataclass, but for some fields.

    So a new field needs a column of its name and no code here.
    """
    return {one.name: getattr(row, one.name) for one in fields(kind) if one.name not in but}


def job_of(row: JobRow) -> Job:
    kept_otherwise: dict[str, Any] = {
        "asset": row.asset.name if row.asset else None,
        "asset_id": row.asset.id if row.asset else None,
        "failure": None if row.failure is None else Failure(**row.failure),
        "summary": None if row.summary is None else summary_of(row.summary),
    }
    return Job(**by_name(row, Job, but=kept_otherwise), **kept_otherwise)


def submitted_columns(submission: Submission) -> dict[str, Any]:
    """The columns of a job that are as they were asked for."""
    asked = {one.name for one in fields(submission)} & set(JobRow.__table__.columns.keys())
    columns = {name: getattr(submission, name) for name in asked}
    return {**columns, "options": dict(submission.options)}


def failure_columns(failure: Failure) -> dict[str, Any]:
    return asdict(failure)


def summary_columns(summary: Summary) -> dict[str, Any]:
    fields = {name: getattr(summary, name) for name in summary.__dataclass_fields__}
    return fields | {"timings": dict(summary.timings), "warnings": list(summary.warnings)}


def summary_of(stored: dict[str, Any]) -> Summary:
    return Summary(**(stored | {"warnings": tuple(stored["warnings"])}))


def files_of(session: Session, job_number: int) -> tuple[JobFile, ...]:
    """The files of a job, by name."""
    rows = session.scalars(
        select(JobFileRow).where(JobFileRow.job_number == job_number).order_by(JobFileRow.name)
    )
    return tuple(
        JobFile(blob=Blob(row.digest, row.size), **by_name(row, JobFile, but=("blob",)))
        for row in rows
    )


def add_files(session: Session, job_number: int, files: Iterable[JobFile]) -> None:
    session.add_all(
        JobFileRow(
            job_number=job_number, digest=file.blob.digest, size=file.blob.size,
            **{name: value for name, value in vars(file).items() if name != "blob"},
        )
        for file in files
    )  # fmt: skip


def find_asset(session: Session, tenant: str, name: str, *, lock: bool = False) -> AssetRow | None:
    query = select(AssetRow).where(AssetRow.tenant == tenant, AssetRow.name == name)
    return session.scalars(query.with_for_update() if lock else query).first()


def asset_named(
    session: Session, tenant: str, name: str, now: float, *, lock: bool = False
) -> tuple[AssetRow, bool]:
    """The asset of a name, made where there is none, and whether it was; two make but one.

    One that was removed, and can be restored, is.
    """
    found = find_asset(session, tenant, name, lock=lock)
    if found is not None and found.goes is not None:
        # Whoever sends it anew wants it; unless it has gone for good meanwhile.
        found = find_asset(session, tenant, name, lock=True)
        if found is not None:
            found.goes = None
    if found is not None:
        return found, False
    made = session.execute(
        dialect_insert(session)(AssetRow)
        .values(id=new_id(), tenant=tenant, name=name, folded=name.casefold(), created=now)
        .on_conflict_do_nothing()
        .returning(AssetRow.id)
    ).first()
    row = find_asset(session, tenant, name, lock=lock)
    if row is None:  # another has made it and removed it since
        raise UndoneError("the asset was removed meanwhile")
    return row, made is not None


NO_RUNS = (JobKind.TRADEOFF, JobKind.VISIBILITY)
"""Kinds of jobs that are no runs of their asset."""


def is_run(job: type[JobRow]) -> ColumnElement[bool]:
    """Whether a job is a run of its asset, as :class:`~service.jobs.asset.AssetStore` says."""
    return and_(job.state == JobState.SUCCEEDED, job.kind.not_in(NO_RUNS))


def with_runs(tenant: str | None) -> Select[AssetRow, JobRow | None, int]:
    """Assets, the latest of the runs of each, and how many they are."""
    run = aliased(JobRow)
    runs_of_it = (run.asset_number == AssetRow.number, is_run(run))
    newest = select(func.max(run.number)).where(*runs_of_it).scalar_subquery()
    count = select(func.count()).select_from(run).where(*runs_of_it).scalar_subquery()
    query = select(AssetRow, JobRow, count).outerjoin(JobRow, JobRow.number == newest)
    return query if tenant is None else query.where(AssetRow.tenant == tenant)


def thresholds_of(row: AssetRow | FolderRow) -> Thresholds:
    return Thresholds(**by_name(row, Thresholds))


Folders = Mapping[str, Mapping[str, Thresholds]]
"""What is demanded of folders, by tenant and path."""


def read_folders(session: Session, *tenants: str) -> Folders:
    """Those of some tenants."""
    query = select(FolderRow).where(FolderRow.tenant.in_(sorted(set(tenants))))
    found: dict[str, dict[str, Thresholds]] = {}
    for row in session.scalars(query):
        found.setdefault(row.tenant, {})[row.path] = thresholds_of(row)
    return found


def asset_of(row: AssetRow, latest: JobRow | None, runs: int, folders: Folders) -> Asset:
    own = thresholds_of(row)
    return Asset(
        id=row.id,
        tenant=row.tenant,
        name=row.name,
        created=row.created,
        thresholds=own,
        demanded=demanded(own, row.name, folders.get(row.tenant, {})),
        runs=runs,
        latest=None if latest is None else job_of(latest),
        goes=row.goes,
    )


def list_query(
    tenant: str | None, wanted: JobFilter, before: int | None, limit: int
) -> Select[JobRow]:
    """The jobs of a page, newest first, and one more, which tells whether there is another page."""
    query = select(JobRow).order_by(JobRow.number.desc()).limit(limit + 1)
    if before is not None:
        query = query.where(JobRow.number < before)
    if len(wanted.states) == 1:
        query = query.where(JobRow.state == min(wanted.states))
    elif wanted.states:
        # "In" would gather and sort all of them by the states' index; this goes from the newest on.
        query = query.where(JobRow.state.not_in(sorted(set(JobState) - wanted.states)))
    if wanted.kinds:
        query = query.where(JobRow.kind.in_(sorted(wanted.kinds)))
    if wanted.asset_id is not None:
        query = query.where(JobRow.asset_number == _asset_number(tenant, wanted.asset_id))
    elif tenant is not None:
        query = query.where(JobRow.tenant == tenant)
    if wanted.created_from is not None:
        query = query.where(JobRow.created >= wanted.created_from)
    if wanted.created_before is not None:
        query = query.where(JobRow.created < wanted.created_before)
    return query


def _asset_number(tenant: str | None, asset_id: str) -> ScalarSelect[int]:
    """Its jobs are of the same tenant, so that they need not be asked for theirs."""
    query = select(AssetRow.number).where(AssetRow.id == asset_id)
    if tenant is not None:
        query = query.where(AssetRow.tenant == tenant)
    return query.scalar_subquery()
