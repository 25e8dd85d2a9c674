"""Jobs as a dispatcher needs them: which are next, one to be claimed by name, one taken back.

The rules are those of :class:`~service.storage.job_store.SqlJobStore`: the same turns, limits and
fences hold for a job that is offered and for one that a worker takes by itself.
"""

from __future__ import annotations

from collections.abc import Callable

from sqlalchemy import select

from service.jobs.job import Claim, Failure, Job, JobFile, JobState
from service.jobs.turns import Shares
from service.storage.database import Database, retried
from service.storage.job_life import JobLife
from service.storage.lines import next_in_turn, take_job
from service.storage.rows import files_of, job_of
from service.storage.tables import JobRow


class SqlOffers:
    """``release``    of this process: it gets work only where that is the one that works.
    ``monotonic``  seconds by the clock of pauses; by default the one that all share.
    """

    def __init__(
        self,
        database: Database,
        release: str | None = None,
        monotonic: Callable[[], float] | None = None,
    ) -> None:
        self._database, self._release = database, release
        self._pauses = monotonic or database.shared_clock

    def next_in_turn(self, shares: Shares, limit: int) -> list[tuple[Job, tuple[JobFile, ...]]]:
        """The jobs that would begin next if ``limit`` began at once, in order, with their inputs.

        ``shares``  what one tenant may have, of all places that there are.
        """
        now = self._pauses()
        with self._database.reading() as session:
            numbers = next_in_turn(session, shares, now, limit)
            rows = session.scalars(select(JobRow).where(JobRow.number.in_(numbers)))
            found = {row.number: row for row in rows}
            return [
                (
                    job_of(found[number]),
                    tuple(one for one in files_of(session, number) if one.is_input),
                )
                for number in numbers
                if number in found
            ]

    @retried
    def claim(self, job_id: str, owner: str, lease_seconds: float, shares: Shares) -> Claim | None:
        """One job that waits; None where it does not wait any more, or may not begin now.

        Raises :class:`~service.errors.NotReadyError` where another release works.
        """
        now = self._pauses()
        with self._database.writing() as session:
            # As in SqlJobStore.claim: one that is lost with the database has never been.
            self._database.do_without_flush(session)
            row = take_job(session, shares, now, self._release, job_id)
            if row is None:
                return None
            JobLife(self._database, session, self._database.clock()).begin(
                row, owner, lease_seconds
            )
            inputs = tuple(file for file in files_of(session, row.number) if file.is_input)
            return Claim(job_of(row), owner, inputs)

    @retried
    def take_back(self, job_id: str, owner: str, failure: Failure | None) -> Job | None:
        """End the attempt of an owner that is gone; the job after that, None where it has no such.

        ``failure``  what the attempt has come to, as where a lease runs out; None where it is to
        cost the job nothing.
        """
        with self._database.writing() as session:
            row = session.scalars(
                select(JobRow)
                .where(
                    JobRow.id == job_id,
                    JobRow.owner == owner,
                    JobRow.state == JobState.RUNNING,
                )
                .with_for_update(of=JobRow)
            ).first()
            if row is None:
                return None
            life = JobLife(self._database, session, self._database.clock())
            if failure is None:
                life.release(row)
            else:
                life.end_attempt(row, failure, 0.0, final=False)
            return job_of(row)
