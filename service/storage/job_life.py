"""How a job begins and how it ends, each step within the transaction of the caller.

This is the one place where a job gets a last state and its webhook is put down, so that a delivery
is there exactly when its job has ended.
"""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.jobs.deliveries import DeliveryState
from service.jobs.job import Failure, JobState, Submission, Summary
from service.storage.rows import (
    add_asset,
    failure_columns,
    find_asset,
    new_id,
    submitted_columns,
    summary_columns,
)
from service.storage.tables import DeliveryRow, JobRow

_TRIES_FOR_ROOM = 10
"""With the pauses between them, twenty minutes and more."""


def same_work(session: Session, submission: Submission) -> Iterator[JobRow]:
    """Jobs of the tenant that have done the same work with success: the first, then the latest on.

    Nearly always the first one will do.  Where it does not, all that were given its result do not
    either, and there may be thousands of those: they are passed over.
    """
    query = select(JobRow).where(
        JobRow.work_key == submission.work_key,
        JobRow.tenant == submission.tenant,
        JobRow.state == JobState.SUCCEEDED,
    )
    first = session.scalars(query.order_by(JobRow.number).limit(1)).first()
    if first is None:
        return
    yield first
    seen = {first.reused or first.id, first.id}
    for row in session.scalars(
        query.order_by(JobRow.number.desc()).execution_options(yield_per=50)
    ):
        if seen.isdisjoint((row.reused, row.id)):
            yield row
        seen.update(one for one in (row.reused, row.id) if one is not None)


def add_job(session: Session, submission: Submission, now: float) -> JobRow:
    """A queued job."""
    tenant, name = submission.tenant, submission.asset
    asset = None
    if name is not None:
        asset = find_asset(session, tenant, name) or add_asset(session, tenant, name, now)
    row = JobRow(
        id=new_id(), state=JobState.QUEUED, work_key=submission.work_key, created=now, asset=asset,
        **submitted_columns(submission),
    )  # fmt: skip
    session.add(row)
    session.flush()
    return row


def end_succeeded(session: Session, row: JobRow, summary: Summary, now: float) -> None:
    row.summary = summary_columns(summary)
    _end(session, row, JobState.SUCCEEDED, now)


def end_cancelled(session: Session, row: JobRow, now: float) -> None:
    _end(session, row, JobState.CANCELLED, now)


def end_attempt(
    session: Session, row: JobRow, failure: Failure, now: float, *, final: bool
) -> None:
    """Settle an attempt that came to nothing: fail, try again, or do as was asked meanwhile.

    Another attempt keeps the job's number, so it is claimed before later ones of its tenant.
    """
    if row.cancel_asked and not final:
        end_cancelled(session, row, now)
    elif row.attempt < row.attempts and not final:
        _queue_again(row)
    else:
        row.failure = failure_columns(failure)
        _end(session, row, JobState.FAILED, now)


def put_off(session: Session, row: JobRow, failure: Failure, now: float) -> None:
    """Queue a job again that this machine had no room for, at no cost; after many tries it fails.

    It is no fault of the job's; but a result that is larger than the disk would come for ever.
    """
    if row.attempt >= _TRIES_FOR_ROOM:
        end_attempt(session, row, failure, now, final=True)
    else:
        release(session, row, now)


def release(session: Session, row: JobRow, now: float) -> None:
    """Queue a job again after an attempt that is not to count: as many are left as before it."""
    if row.cancel_asked:
        end_cancelled(session, row, now)
    else:
        row.attempts += 1
        _queue_again(row)


def _queue_again(row: JobRow) -> None:
    row.state, row.owner, row.started = JobState.QUEUED, None, None


def _end(session: Session, row: JobRow, state: JobState, now: float) -> None:
    row.state, row.owner, row.ended = state, None, now
    if row.webhook is not None:
        session.add(
            DeliveryRow(
                id=new_id(),
                job_number=row.number,
                state=DeliveryState.WAITING,
                url=row.webhook,
                since=now,
                due=now,
            )
        )
