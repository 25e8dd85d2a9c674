"""The steps by which a job is taken in, each within the transaction of the caller."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.errors import ConflictError, QueueFullError
from service.jobs.job import JobState, Submission
from service.storage.asset_rows import add_asset, asset_named
from service.storage.rows import new_id
from service.storage.tables import IdempotencyKeyRow, JobRow

_RETRY_SECONDS = 5
"""When a queue that is full is worth another try: most jobs take less."""


def earlier_job(session: Session, submission: Submission) -> JobRow | None:
    """The job that the same idempotency key gave before.

    Raises :class:`~service.errors.ConflictError` where the request was another.
    """
    if submission.idempotency_key is None:
        return None
    key = session.get(IdempotencyKeyRow, (submission.tenant, submission.idempotency_key))
    if key is None:
        return None
    if key.fingerprint != submission.fingerprint:
        raise ConflictError(
            f"the idempotency key '{submission.idempotency_key}' was used for another request",
            remedy="choose a new key for a new request",
        )
    return session.get_one(JobRow, key.job_number)


def key_known(session: Session, tenant: str, key: str) -> bool:
    """Whether an idempotency key has given a job before."""
    return session.get(IdempotencyKeyRow, (tenant, key)) is not None


def same_work(session: Session, submission: Submission) -> JobRow | None:
    """The first job of the tenant that has done the same work with success."""
    return session.scalars(
        select(JobRow)
        .where(
            JobRow.work_key == submission.work_key,
            JobRow.tenant == submission.tenant,
            JobRow.state == JobState.SUCCEEDED,
        )
        .order_by(JobRow.number)
        .limit(1)
    ).first()


def check_room(session: Session, queue_limit: int) -> None:
    """Raises :class:`~service.errors.QueueFullError`."""
    waiting = session.scalars(
        select(func.count()).select_from(JobRow).where(JobRow.state == JobState.QUEUED)
    ).one()
    if waiting >= queue_limit:
        raise QueueFullError(waiting, _RETRY_SECONDS)


def add_job(session: Session, submission: Submission, now: float) -> JobRow:
    """A queued job, and the key that will give it again."""
    tenant, name = submission.tenant, submission.asset
    asset = None
    if name is not None:
        asset = asset_named(session, tenant, name) or add_asset(session, tenant, name, now)
    row = JobRow(
        id=new_id(),
        tenant=tenant,
        kind=submission.kind,
        state=JobState.QUEUED,
        name=submission.name,
        options=dict(submission.options),
        version=submission.version,
        work_key=submission.work_key,
        created=now,
        attempts=submission.attempts,
        asset=asset,
        webhook=submission.webhook,
        retry_of=submission.retry_of,
    )
    session.add(row)
    session.flush()
    if submission.idempotency_key is not None:
        session.add(
            IdempotencyKeyRow(
                tenant=submission.tenant,
                key=submission.idempotency_key,
                fingerprint=submission.fingerprint,
                job_number=row.number,
            )
        )
    return row
