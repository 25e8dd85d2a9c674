"""Jobs in the database; see :class:`service.jobs.stores.JobStore` for what is promised."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from operator import attrgetter

from sqlalchemy import Select, delete, exists, func, not_, or_, select, update
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
from service.storage.database import Database, UndoneError, retried
from service.storage.job_life import JobLife, add_job, same_work
from service.storage.leases import Beat, LeaseWatch
from service.storage.lines import check_room, counted, first_places, place_of, take_turn
from service.storage.rows import (
    add_files,
    files_of,
    is_run,
    job_of,
    list_query,
)
from service.storage.tables import JobFileRow, JobRow
from service.storage.waits import pause_after_death, pause_for_room

RelyOn = Callable[[Session, Collection[Blob]], None]

_EXPIRED_AT_ONCE = 200
"""Jobs that are forgotten in one transaction, so that other writers do not wait long."""


class SqlJobStore:
    """Jobs and their files.

    ``clock``      the time of day, for what people see and for ages; no decision about a job that
                   has not ended depends on it.
    ``monotonic``  seconds from a clock that is never set, for leases, and for pauses where the
                   database has no clock that all share.
    ``shares``     what one tenant may have of the queue and of the workers.
    ``is_stored``  whether the bytes of a blob are there: a result that has lost one is no result.
    ``rely_on``    called with the blobs of files within the transaction that adds these: what keeps
                   a sweep of others from taking them.  Raises what undoes the transaction.
    ``release``    of this server: it gets work only where that is the one that works; None for any.
    """

    def __init__(
        self,
        database: Database,
        clock: Callable[[], float] | None = None,
        monotonic: Callable[[], float] | None = None,
        shares: Shares = Shares(),  # noqa: B008 - it never changes
        is_stored: Callable[[Blob], bool] = lambda blob: True,
        rely_on: RelyOn = lambda session, blobs: None,
        release: str | None = None,
    ) -> None:
        self._database = database
        self._rely_on = rely_on
        self._shares, self._is_stored, self._release = shares, is_stored, release
        self._clock = clock or database.clock
        self._pauses = monotonic or database.shared_clock
        self._leases = LeaseWatch(monotonic or time.monotonic)

    def _life(self, session: Session) -> JobLife:
        return JobLife(self._database, session, self._clock())

    @retried
    def submit(self, submission: Submission, queue_limit: int) -> tuple[Job, bool]:
        with self._database.writing() as session:
            done = self._stored_result(session, submission) if submission.may_reuse else None
            done = None if done is None else _kept(session, done)
            room = (session, submission.tenant, queue_limit, self._shares)
            most = check_room(*room) if done is None else 0
            life = self._life(session)
            row = add_job(session, submission, life.now)
            self._add_files(session, row, submission.inputs)
            if done is None:
                if not life.queue(row, most):  # others were faster
                    check_room(*room)
                    raise UndoneError("the queue was full for a moment")
            else:
                results = [file for file in files_of(session, done.number) if not file.is_input]
                self._add_files(session, row, results)
                life.reuse(row, done)
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

    def _add_files(self, session: Session, row: JobRow, files: Sequence[JobFile]) -> None:
        self._rely_on(session, [file.blob for file in files])
        add_files(session, row.number, files)

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
            places = first_places(session, tenant, limit)
            rows = session.scalars(select(JobRow).where(JobRow.number.in_(places)))
            found = {row.number: job_of(row) for row in rows}
        return tuple((place, found[number]) for number, place in places.items() if number in found)

    def place(self, number: int) -> int | None:
        with self._database.reading() as session:
            return place_of(session, number)

    def files(self, job_id: str) -> tuple[JobFile, ...]:
        with self._database.reading() as session:
            number = session.scalars(select(JobRow.number).where(JobRow.id == job_id)).first()
            return () if number is None else files_of(session, number)

    @retried
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

    @retried
    def cancel(self, tenant: str | None, job_id: str) -> Job:
        with self._database.writing() as session:
            row = _find(session, tenant, job_id, lock=True)
            if row.state.ended:
                raise ConflictError(
                    f"the job '{job_id}' has {row.state} already",
                    remedy="only jobs that are queued or running can be cancelled",
                )
            if row.state is JobState.QUEUED:
                self._life(session).end_cancelled(row)
            else:
                row.cancel_asked = True
            return job_of(row)

    def counts(self) -> Mapping[JobState, int]:
        ended = [state for state in JobState if state.ended]
        query = (
            select(JobRow.state, func.count()).where(JobRow.state.in_(ended)).group_by(JobRow.state)
        )
        with self._database.reading() as session:
            rows = session.execute(query).all()
            waiting, running = counted(session)
        counts = dict.fromkeys(JobState, 0)
        counts.update((state, count) for state, count in rows)
        return counts | {JobState.QUEUED: waiting, JobState.RUNNING: running}

    def oldest_queued(self) -> float | None:
        query = select(func.min(JobRow.created)).where(JobRow.state == JobState.QUEUED)
        with self._database.reading() as session:
            return session.scalars(query).one()

    @retried
    def claim(self, owner: str, lease_seconds: float) -> Claim | None:
        now = self._pauses()
        with self._database.writing() as session:
            # Who claims next waits until this is committed.  A claim that is lost with the database
            # server has never been: its worker finds that it does not hold the row.
            self._database.do_without_flush(session)
            row = take_turn(session, self._shares, now, self._release)
            if row is None:
                return None
            self._life(session).begin(row, owner, lease_seconds)
            self._leases.note(row.id, _beat(row))
            inputs = tuple(file for file in files_of(session, row.number) if file.is_input)
            return Claim(job_of(row), owner, inputs)

    @retried
    def renew(self, claims: Collection[Claim], lease_seconds: float) -> Mapping[str, bool]:
        held: dict[str, bool] = {}
        with self._database.writing() as session:
            self._database.do_without_flush(session)
            numbers = [claim.job.number for claim in claims]
            rows = session.scalars(
                select(JobRow)
                .where(JobRow.number.in_(numbers))
                .order_by(JobRow.number)
                .with_for_update(of=JobRow)
            )
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

    def cancelled(self, claims: Collection[Claim]) -> frozenset[str]:
        numbers = [claim.job.number for claim in claims]
        with self._database.reading() as session:
            query = select(JobRow.id).where(JobRow.number.in_(numbers), JobRow.cancel_asked)
            return frozenset(session.scalars(query))

    @retried
    def succeed(self, claim: Claim, files: Sequence[JobFile], summary: Summary) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            self._add_files(session, row, files)
            self._life(session).succeed(row, summary)
            return True

    @retried
    def fail(self, claim: Claim, failure: Failure, *, final: bool) -> JobState | None:
        due = self._pauses() + pause_after_death(claim.job.attempt)
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return None
            self._life(session).end_attempt(row, failure, due, final=final)
            return row.state

    @retried
    def put_off(self, claim: Claim, failure: Failure) -> JobState | None:
        due = self._pauses() + pause_for_room(claim.job.attempt)
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return None
            self._life(session).put_off(row, failure, due)
            return row.state

    @retried
    def add_files(self, job_id: str, files: Sequence[JobFile]) -> bool:
        with self._database.writing() as session:
            row = session.scalars(
                select(JobRow).where(JobRow.id == job_id).with_for_update(of=JobRow)
            ).first()
            if row is None or row.state is not JobState.SUCCEEDED:
                return False
            there = {file.name for file in files_of(session, row.number)}
            self._add_files(session, row, [file for file in files if file.name not in there])
            return True

    @retried
    def end_cancelled(self, claim: Claim) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            self._life(session).end_cancelled(row)
            return True

    @retried
    def release(self, claim: Claim) -> bool:
        with self._database.writing() as session:
            row = _claimed_row(session, claim)
            if row is None:
                return False
            self._life(session).release(row)
            return True

    @retried
    def recover(self, failure: Failure, *, all_leases: bool) -> Sequence[Job]:
        """A lease of another server runs from when this one first looks at it."""
        with self._database.writing() as session:
            if all_leases:
                # Pauses that a server of before has given, by a clock that may have begun anew.
                session.execute(
                    update(JobRow)
                    .where(JobRow.state == JobState.QUEUED, JobRow.due > 0.0)
                    .values(due=0.0)
                    .execution_options(synchronize_session=False)
                )
            leases = self._leases_of(session)
            suspected = [number for number, silent in leases.items() if all_leases or silent]
            rows = session.scalars(
                select(JobRow)
                .where(JobRow.number.in_(suspected), JobRow.state == JobState.RUNNING)
                .with_for_update(of=JobRow, skip_locked=True)
            ).all()
            # Its holder may have given a sign of life just now.
            lost = [
                row
                for row in sorted(rows, key=attrgetter("number"))
                if all_leases or self._leases.silence(row.id, _beat(row)) > row.lease_seconds
            ]
            life = self._life(session)
            for row in lost:
                life.end_attempt(row, failure, 0.0, final=False)
            return [job_of(row) for row in lost]

    def _leases_of(self, session: Session) -> dict[int, bool]:
        """Jobs that run, by number, and whether their holder is silent."""
        query = select(
            JobRow.number, JobRow.id, JobRow.attempt, JobRow.beat, JobRow.lease_seconds
        ).where(JobRow.state == JobState.RUNNING)
        running = session.execute(query).all()
        self._leases.keep_only({row.id for row in running})
        return {
            row.number: self._leases.silence(row.id, Beat(row.attempt, row.beat))
            > row.lease_seconds
            for row in running
        }


def _find(session: Session, tenant: str | None, job_id: str, *, lock: bool = False) -> JobRow:
    query = select(JobRow).where(JobRow.id == job_id)
    row = session.scalars(query.with_for_update(of=JobRow) if lock else query).first()
    if row is None or tenant not in (None, row.tenant):
        raise NotFoundError(
            f"there is no job '{job_id}'", remedy="look for it in the list of jobs, /v1/jobs"
        )
    return row


def _kept(session: Session, done: JobRow) -> JobRow | None:
    """A job that is not forgotten before the transaction ends; None where it is by now."""
    query = select(JobRow).where(JobRow.number == done.number)
    return session.scalars(query.with_for_update(of=JobRow, read=True, key_share=True)).first()


def _claimed_row(session: Session, claim: Claim) -> JobRow | None:
    """The job of a claim, locked, unless it was ended or taken back since."""
    row = session.scalars(
        select(JobRow).where(JobRow.number == claim.job.number).with_for_update(of=JobRow)
    ).first()
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
