"""How a job begins and how it ends, each step within the transaction of the caller.

This is the one place where a job changes its state: its tenant's line counts it, those who wait are
told, and its webhook is put down, so that a delivery is there exactly when its job has ended.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from service.jobs.deliveries import DeliveryState
from service.jobs.job import Failure, JobState, Submission, Summary
from service.storage.database import Database, Topic
from service.storage.lines import join_line, move_in_line
from service.storage.rows import (
    asset_named,
    failure_columns,
    new_id,
    submitted_columns,
    summary_columns,
)
from service.storage.tables import DeliveryRow, JobRow, ProgressRow

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
    """A job that has no place in a line yet."""
    tenant, name = submission.tenant, submission.asset
    asset = None if name is None else asset_named(session, tenant, name, now)[0]
    row = JobRow(
        id=new_id(), state=JobState.QUEUED, work_key=submission.work_key, created=now, asset=asset,
        **submitted_columns(submission),
    )  # fmt: skip
    session.add(row)
    session.flush()
    return row


@dataclass(frozen=True)
class JobLife:
    """Changes the states of jobs, within a transaction; ``now`` is the time of day."""

    database: Database
    session: Session
    now: float

    def queue(self, row: JobRow, most: int) -> bool:
        """Put a new job in its line, if no more than ``most`` wait in it then."""
        self.session.flush()
        self.database.tell(self.session, Topic.QUEUED)
        return join_line(self.session, row.tenant, most)

    def begin(self, row: JobRow, owner: str, lease_seconds: float) -> None:
        """An attempt, which :func:`~service.storage.lines.take_turn` has counted already."""
        row.state = JobState.RUNNING
        row.owner = owner
        row.attempt += 1
        row.started = self.now
        row.lease_seconds = lease_seconds

    def reuse(self, row: JobRow, done: JobRow) -> None:
        """Give a new job, of no line, the result of another."""
        assert done.summary is not None  # a check of the table's
        row.reused, row.summary = done.id, dict(done.summary)
        self._enter(row, JobState.SUCCEEDED)

    def succeed(self, row: JobRow, summary: Summary) -> None:
        row.summary = summary_columns(summary)
        self._end(row, JobState.SUCCEEDED)

    def end_cancelled(self, row: JobRow) -> None:
        self._end(row, JobState.CANCELLED)

    def end_attempt(self, row: JobRow, failure: Failure, pause: float, *, final: bool) -> None:
        """Settle an attempt that came to nothing: fail, try again, or do as was asked meanwhile.

        Another attempt keeps the job's number, so it is claimed before later ones of its tenant,
        when its ``pause`` is over by the clock of pauses.
        """
        if row.cancel_asked and not final:
            self.end_cancelled(row)
        elif row.attempt < row.attempts and not final:
            self._queue_again(row, pause)
        else:
            row.failure = failure_columns(failure)
            self._end(row, JobState.FAILED)

    def put_off(self, row: JobRow, failure: Failure, pause: float) -> None:
        """Queue a job again that this machine had no room for, at no cost; after many tries it
        fails.

        It is no fault of the job's; but a result that is larger than the disk would come for ever.
        """
        if row.attempt >= _TRIES_FOR_ROOM:
            self.end_attempt(row, failure, pause, final=True)
        else:
            self.release(row, pause)

    def release(self, row: JobRow, pause: float = 0.0) -> None:
        """Queue a job again after an attempt that is not to count: as many are left as before."""
        if row.cancel_asked:
            self.end_cancelled(row)
        else:
            row.attempts += 1
            self._queue_again(row, pause)

    def _queue_again(self, row: JobRow, due: float) -> None:
        row.state, row.owner, row.started, row.due = JobState.QUEUED, None, None, due
        self.session.flush()
        self._forget_progress(row)
        move_in_line(self.session, row.tenant, waiting=1, running=-1)
        self.database.tell(self.session, Topic.QUEUED)

    def _end(self, row: JobRow, state: JobState) -> None:
        was = {"waiting": -1} if row.state is JobState.QUEUED else {"running": -1}
        self._enter(row, state)
        self.session.flush()
        self._forget_progress(row)
        move_in_line(self.session, row.tenant, **was)

    def _forget_progress(self, row: JobRow) -> None:
        if self.database.shared:
            self.session.execute(delete(ProgressRow).where(ProgressRow.job_id == row.id))

    def _enter(self, row: JobRow, state: JobState) -> None:
        """A last state."""
        row.state, row.owner, row.ended = state, None, self.now
        if row.webhook is not None:
            self.session.add(
                DeliveryRow(
                    id=new_id(),
                    job_number=row.number,
                    state=DeliveryState.WAITING,
                    url=row.webhook,
                    since=self.now,
                    due=self.now,
                )
            )
        self.database.tell(self.session, Topic.ENDED, row.id)
