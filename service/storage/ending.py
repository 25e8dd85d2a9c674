"""How a job ends: the one place where it gets a last state, and its webhook is put down.

All of it in the transaction of the caller, so that a delivery is there exactly when its job ended.
"""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.jobs.job import Failure, JobState, Summary
from service.storage.rows import failure_columns, new_id, summary_columns
from service.storage.tables import DeliveryRow, DeliveryState, JobRow


def end_succeeded(session: Session, row: JobRow, summary: Summary, now: float) -> None:
    row.summary = summary_columns(summary)
    _end(session, row, JobState.SUCCEEDED, now)


def end_cancelled(session: Session, row: JobRow, now: float) -> None:
    _end(session, row, JobState.CANCELLED, now)


def end_attempt(
    session: Session, row: JobRow, failure: Failure, now: float, *, final: bool
) -> None:
    """After an attempt that came to nothing: fail, try again, or do as was asked meanwhile.

    Another attempt keeps the job's number, so it is the next to be claimed.
    """
    if row.cancel_asked and not final:
        end_cancelled(session, row, now)
    elif row.attempt < row.attempts and not final:
        _queue_again(row)
    else:
        row.failure = failure_columns(failure)
        _end(session, row, JobState.FAILED, now)


def release(session: Session, row: JobRow, now: float) -> None:
    """After an attempt that is not to count: as many are left as before it."""
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
