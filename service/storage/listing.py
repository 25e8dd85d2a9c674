"""Which jobs a list shows, and in what order."""

from __future__ import annotations

from sqlalchemy import Select, select

from service.jobs.stores import JobFilter
from service.storage.tables import AssetRow, JobRow


def listed(tenant: str | None, wanted: JobFilter, before: int | None, limit: int) -> Select[JobRow]:
    """Newest first, and one more than the limit, which tells whether there is another page."""
    query = select(JobRow).order_by(JobRow.number.desc()).limit(limit + 1)
    if tenant is not None:
        query = query.where(JobRow.tenant == tenant)
    if before is not None:
        query = query.where(JobRow.number < before)
    if wanted.states:
        query = query.where(JobRow.state.in_(sorted(wanted.states)))
    if wanted.kinds:
        query = query.where(JobRow.kind.in_(sorted(wanted.kinds)))
    if wanted.asset_id is not None:
        asset = select(AssetRow.number).where(AssetRow.id == wanted.asset_id).scalar_subquery()
        query = query.where(JobRow.asset_number == asset)
    if wanted.created_from is not None:
        query = query.where(JobRow.created >= wanted.created_from)
    if wanted.created_before is not None:
        query = query.where(JobRow.created < wanted.created_before)
    return query
