"""Which jobs a list shows, and in what order."""

from __future__ import annotations

from sqlalchemy import ScalarSelect, Select, select

from service.jobs.job import JobState
from service.jobs.stores import JobFilter
from service.storage.tables import AssetRow, JobRow


def list_query(
    tenant: str | None, wanted: JobFilter, before: int | None, limit: int
) -> Select[JobRow]:
    """Newest first, and one more than the limit, which tells whether there is another page."""
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


def queue_query(tenant: str | None, limit: int) -> Select[JobRow]:
    """Those that wait, the next first."""
    query = (
        select(JobRow).where(JobRow.state == JobState.QUEUED).order_by(JobRow.number).limit(limit)
    )
    return query if tenant is None else query.where(JobRow.tenant == tenant)


def _asset_number(tenant: str | None, asset_id: str) -> ScalarSelect[int]:
    """Its jobs are of the same tenant, so that they need not be asked for theirs."""
    query = select(AssetRow.number).where(AssetRow.id == asset_id)
    if tenant is not None:
        query = query.where(AssetRow.tenant == tenant)
    return query.scalar_subquery()
