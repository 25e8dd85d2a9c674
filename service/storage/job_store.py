"""Jobs in the database; see :class:`service.jobs.stores.JobStore` for what is promised."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from itertools import islice
from operator import itemgetter

from sqlalchemy import Select, delete, exists, func, not_, or_, select
from sqlalchemy.orm import Session, aliased

from service.errors import ConflictError, NotFoundError
from service.jobs.job import (
    Blob,
    Claim,
    Failure,
    Job,
    JobFile,
    JobState,
    Submission,
    Summary,
)
from service.jobs.stores import JobFilter, JobPage
from service.jobs.turns import Shares
from service.storage.database import Database
from service.storage.job_life import (
    add_job,
    end_attempt,
    end_cancelled,
    end_succeeded,
    put_off,
    release,
    same_work,
)
from service.storage.leases import Beat, LeaseWatch
from service.storage.rows import (
    add_files,
    files_of,
    is_run,
    job_of,
    list_query,
    summary_of,
)
from service.storage.tables import JobFileRow, JobRow
from service.storage.turns import check_room, take_turn, waiting_in_turn
from service.storage.waits import Waits, pause_after_death, pause_for_room

_EXPIRED_AT_ONCE = 200
"""Jobs that are forgotten in one transaction, so that other writers do not wait long."""


class SqlJobStore:
    """Jobs and their files.

    Reads, then writes, within one transaction that no other writes beside: what was read holds.

    ``clock``      the time of day, for what people see and for ages; no decision about a job that
                   has not ended depends on it.
    ``monotonic``  seconds from a clock that is never set, for leases.
    ``shares``     what one tenant may have of the queue and of the workers.
    ``is_stored``  whether the bytes of a blob are there: a result that has lost one is no result.
    """

    def __init__(
        self,
        database: Database,
        clock: Callable[[], float] = time.time,
        monotonic: Callable[[], float] = time.monotonic,
        shares: Shares = Shares(),  # noqa: B008 - it never changes
        is_stored: Callable[[Blob], bool] = lambda blob: True,
    ) -> None:
        self._database = database
        self._shares, self._is_stored = shares, is_stored
        self._clock = clock
        self._leases = LeaseWatch(monotonic)
        self._waits = Waits(monotonic)

    def submit(self, submission: Submission, queue_limit: int) -> tuple[Job, bool]:
        with self._database.writing() as session:
            done = self._stored_result(session, submission) if submission.may_reuse else None
            if done is None:
                check_room(session, submission.tenant, queue_limit, self._shares)
            row = add_job(session, submission, self._clock())
            add_files(session, row.number, submission.inputs)
            if done is not None:
                self._reuse(session, row, done)
            session.flush()
            return job_of(row), done is None

    def stored_result(self, submission: Submission) -> tuple[JobFile, ...]:
        if not submission.may_reuse:
            return ()
        with self._database.reading() as session:
            done = self._stored_result(session, submission)
            if done is None:
                return ()
            return tuple(one for one in files_of(session, done.number) if not one.is_input)

    def check_room(self, tenant: str, queue_limit: int) -> None:
        with self._database.reading() as session:
            check_room(session, tenant, queue_limit, self._shares)

    def _stored_result(self, session: Session, submission: Submission) -> JobRow | None:
        """The first job of the same work whose results are all there."""

        def is_whole(row: JobRow) -> bool:
            files = files_of(session, row.number)
            return all(self._is_stored(file.blob) for file in files if not file.is_input)

        return next(filter(is_whole, same_work(session, submission)), None)

    def _reuse(self, session: Session, row: JobRow, done: JobRow) -> None:
        results = [file for file in files_of(session, done.number) if not file.is_input]
        add_files(session, row.number, results)
        assert done.summary is not None  # a check of the table's
        row.reused = done.id
        end_succeeded(session, row, summary_of(done.summary), self._clock())

    def job(self, tenant: str | None, job_id: str) -> Job:
        with self._database.reading() as session:
            return job_of(_find(session, tenant, job_id))

    def jobs(
        self, tenant: str | None, wanted: JobFilter, *, before: int | None, limit: int
    ) -> JobPage:
        with self._database.reading() as session:
            found = [
                job_of(row) for row in session.scalars(list_query(tenant, wanted, before, limit))
            ]
        page = tuple(found[:limit])
        return JobPage(page, page[-1].number if len(found) > limit else None)

    def queue(self, tenant: str | None, limit: int) -> tuple[tuple[int, Job], ...]:
        with self._database.reading() as session:
            line = enumerate(waiting_in_turn(session), 1)
            mine = ((place, job) for place, job in line if tenant in (None, job.tenant))
            places = {job.number: place for place, job in islice(mine, limit)}
            rows = session.scalars(select(JobRow).where(JobRow.number.in_(places)))
            found = [(places[row.number], job_of(row)) for row in rows]
        return tuple(sorted(found, key=itemgetter(0)))

    def place(self, number: int) -> int | None:
        with self._database.reading() as session:
            line = enumerate(waiting_in_turn(session), 1)
            return next((place for place, job in line if job.number == number), None)

    def files(self, job_id: str) -> tuple[JobFile, ...]:
        with self._database.reading() as session:
            number = session.scalars(select(JobRow.number).where(JobRow.id == job_id)).first()
            return () if number is None else files_of(session, number)

    def expire(self, ended_before: float) -> int:
        """Forget old jobs, some in each of several transactions."""
        expired = 0
        while True:
            with self._database.writing() as session:
                numbers = session.scalars(_old(ended_before)).all()
                session.execute(delete(JobRow).where(JobRow.number.in_(numbers)))
            expired += len(numbers)
            if len(numbers) < _EXPIRED_AT_ONCE:
                return expired

    def unnamed(self, digests: Collection[str]) -> set[str]:
        with self._database.reading() as session:
            named = session.scalars(select(JobFileRow.digest).where(JobFileRow.digest.in_(digests)))
            return set(digests).difference(named)

    def cancel(self, tenant: str | None, job_id: str) -> Job:
        with self._database.writing() as session:
            row = _find(session, tenant, job_id)
            if row.state.ended:
                raise ConflictError(
                    f"the job '{job_id}' has {row.state} already",
                    remedy="only jobs that are queued or running can be cancelled",
                )
            if row.state is JobState.QUEUED:
                end_cancelled(session, row, self._clock())
            else:
                row.cancel_asked = True
            return job_of(row)

    def counts(self) -> Mapping[JobState, int]:
        with self._database.reading() as session:
            rows = session.execute(select(JobRow.state, func.count()).group_by(JobRow.state)).all()
        counts = dict.fromkeys(JobState, 0)
        counts.update((state, count) for state, count in rows)
        return counts

    def oldest_queued(self) -> float | None:
        query = select(func.min(JobRow.created)).where(JobRow.state == JobState.QUEUED)
        with self._database.reading() as session:
            return session.scalars(query).one()

    def claim(self, owner: str, lease_seconds: float) -> Claim | None:
        with self._database.writing() as session:
            row = take_turn(session, self._shares, self._waits.numbers())
            if row is None:
                return None
            row.state = JobState.RUNNING
            row.owner = owner
            row.attempt += 1
            row.started = self._clock()
            row.lease_seconds = lease_seconds
            self._leases.note(row.id, _beat(row))
            inputs = tuple(file for file in files_of(session, row.number) if file.is_input)
            return Claim(job_of(row), owner, inputs)

    def renew(self, claims: Collection[Claim], lease_seconds: float) -> Mapping[str, bool]:
        held: dict[str, bool] = {}
        with self._database.writing() as session:
            numbers = [claim.job.number for claim in claims]
            rows = session.scalars(select(JobRow).where(JobRow.number.in_(numbers)))
            found = {row.number: row for row in rows}
            for claim in claims:
                row = found.get(claim.job.number)
                if row is None or not _holds(claim, row):
                    continue
                row.beat += 1
                row.lease_seconds = lease_seconds
                self._leases.note(row.id, _beat(row))
                held[row.id] = row.cancel_asked
        return held

    def succeed(self, claim: Claim, files: Sequence[JobFile], summary: Summary) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            add_files(session, row.number, files)
            end_succeeded(session, row, summary, self._clock())
            return True

    def fail(self, claim: Claim, failure: Failure, *, final: bool) -> JobState | None:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return None
            end_attempt(session, row, failure, self._clock(), final=final)
            if row.state is JobState.QUEUED:
                self._waits.put_off(row.number, pause_after_death(row.attempt))
            return row.state

    def put_off(self, claim: Claim, failure: Failure) -> JobState | None:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return None
            put_off(session, row, failure, self._clock())
            if row.state is JobState.QUEUED:
                self._waits.put_off(row.number, pause_for_room(row.attempt))
            return row.state

    def add_pages(self, job_id: str, files: Sequence[JobFile]) -> bool:
        with self._database.writing() as session:
            row = session.scalars(select(JobRow).where(JobRow.id == job_id)).first()
            if row is None or row.state is not JobState.SUCCEEDED:
                return False
            there = {file.name for file in files_of(session, row.number)}
            add_files(session, row.number, [file for file in files if file.name not in there])
            return True

    def end_cancelled(self, claim: Claim) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            end_cancelled(session, row, self._clock())
            return True

    def release(self, claim: Claim) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            release(session, row, self._clock())
            return True

    def recover(self, failure: Failure, *, all_leases: bool) -> Sequence[Job]:
        """A lease of another server runs from when this one first looks at it."""
        with self._database.writing() as session:
            running = session.scalars(
                select(JobRow).where(JobRow.state == JobState.RUNNING).order_by(JobRow.number)
            ).all()
            self._leases.keep_only({row.id for row in running})
            silent = [
                row
                for row in running
                if all_leases or self._leases.silence(row.id, _beat(row)) > row.lease_seconds
            ]
            for row in silent:
                end_attempt(session, row, failure, self._clock(), final=False)
            return [job_of(row) for row in silent]


def _find(session: Session, tenant: str | None, job_id: str) -> JobRow:
    row = session.scalars(select(JobRow).where(JobRow.id == job_id)).first()
    if row is None or tenant not in (None, row.tenant):
        raise NotFoundError(
            f"there is no job '{job_id}'", remedy="look for it in the list of jobs, /v1/jobs"
        )
    return row


def _claimed_row(session: Session, claim: Claim) -> JobRow | None:
    """The job of a claim, unless it was ended or taken back since."""
    row = session.get(JobRow, claim.job.number)
    return row if row is not None and _holds(claim, row) else None


def _holds(claim: Claim, row: JobRow) -> bool:
    mine = (row.owner, row.attempt) == (claim.owner, claim.job.attempt)
    return mine and row.state is JobState.RUNNING


def _beat(row: JobRow) -> Beat:
    return Beat(row.attempt, row.beat)


def _old(ended_before: float) -> Select[int]:
    """Numbers of some jobs that ended before then and are no asset's latest run."""
    later = aliased(JobRow)
    outrun = exists().where(
        later.asset_number == JobRow.asset_number,
        is_run(later),
        later.number > JobRow.number,
    )
    return (
        select(JobRow.number)
        .where(
            JobRow.ended < ended_before,
            or_(JobRow.asset_number.is_(None), not_(is_run(JobRow)), outrun),
        )
        .limit(_EXPIRED_AT_ONCE)
    )
