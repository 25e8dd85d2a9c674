"""The line before the workers, as the database has it: who is next, and how much stands before.

What is asked for a claim grows with the tenants that wait, and neither with the jobs of one nor
with tenants that have none: it jumps from tenant to tenant along an index, and looks at the first
job of each priority.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Collection

from sqlalchemy import bindparam, func, select, text
from sqlalchemy.orm import Session

from service.errors import QueueFullError, TenantQueueFullError
from service.jobs.job import JobState, Priority
from service.jobs.turns import Shares, Standing, Waiting, chosen, in_turn
from service.storage.tables import ApiKeyRow, JobRow, TurnRow

_FIRST_OF = """
        SELECT number FROM jobs
        WHERE state = 'queued' AND tenant = line.tenant AND priority = '{}'
          AND number NOT IN :put_off
        ORDER BY number LIMIT 1"""

# Words of the index are written out: what a statement is told later cannot be planned with.
_NEXT = text(
    f"""
    WITH RECURSIVE line(tenant) AS (
        SELECT min(tenant) FROM jobs WHERE state = 'queued'
        UNION ALL
        SELECT (SELECT min(tenant) FROM jobs WHERE state = 'queued' AND tenant > line.tenant)
        FROM line WHERE line.tenant IS NOT NULL
    ), heads AS MATERIALIZED (
        SELECT line.tenant AS tenant, coalesce(turns.turn, 0) AS turn,
               coalesce(turns.streak, 0) AS streak,
               ({_FIRST_OF.format(Priority.INTERACTIVE)}) AS interactive,
               ({_FIRST_OF.format(Priority.BULK)}) AS bulk
        FROM line LEFT JOIN turns ON turns.tenant = line.tenant
        WHERE line.tenant IS NOT NULL AND (
            (SELECT count(*) FROM jobs WHERE state = 'running' AND tenant = line.tenant) < :most
            OR :free AND NOT coalesce(line.tenant <> :least OR line.tenant <> :greatest, 0)
        )
    )
    SELECT tenant, interactive, bulk, streak FROM heads
    WHERE interactive IS NOT NULL OR bulk IS NOT NULL
    ORDER BY turn, coalesce(min(interactive, bulk), interactive, bulk) LIMIT 1
    """
).bindparams(bindparam("put_off", expanding=True))

_LOOKED_AT = 200
"""Jobs that ended last, of which the speed of the queue is told."""

_UNKNOWN_SECONDS = 5.0
"""Of a job, where none has ended yet."""

_SHORTEST, _LONGEST = 1, 600
"""Seconds that a refused client is told to wait: further ahead nobody knows."""


def take_turn(session: Session, shares: Shares, put_off: Collection[int]) -> JobRow | None:
    """The job that is next, its tenant's turn noted; None where no one may have one.

    ``put_off``  numbers of jobs that are not to be begun yet.
    """
    least, greatest = _keyed(session)
    found = session.execute(
        _NEXT,
        {"put_off": list(put_off), "most": shares.most_running, "free": shares.running is None,
         "least": least, "greatest": greatest},
    ).first()  # fmt: skip
    if found is None:
        return None
    number, streak = chosen(found.interactive, found.bulk, found.streak)
    turn = 1 + (session.scalar(select(func.max(TurnRow.turn))) or 0)
    session.merge(TurnRow(tenant=found.tenant, turn=turn, streak=streak))
    return session.get_one(JobRow, number)


def waiting_in_turn(session: Session) -> list[Waiting]:
    """All jobs that wait, the next first; limits and pauses are left aside."""
    jobs = session.execute(
        select(JobRow.number, JobRow.tenant, JobRow.priority)
        .where(JobRow.state == JobState.QUEUED)
        .order_by(JobRow.number)
    )
    turns = session.scalars(select(TurnRow))
    standings = {row.tenant: Standing(row.turn, row.streak) for row in turns}
    return in_turn((Waiting(*job) for job in jobs), standings)


def check_room(session: Session, tenant: str, queue_limit: int, shares: Shares) -> None:
    """Raises :class:`~service.errors.QueueFullError`.

    A tenant of whom nothing waits has always room for a job: others cannot shut it out.
    """
    waiting = select(func.count()).select_from(JobRow).where(JobRow.state == JobState.QUEUED)
    own = session.scalars(waiting.where(JobRow.tenant == tenant)).one()
    if own == 0:
        return
    least, greatest = _keyed(session)
    others = least is not None and (least, greatest) != (tenant, tenant)
    most = shares.most_waiting(queue_limit, others=others)
    everyone = session.scalars(waiting).one()
    if everyone >= queue_limit:
        raise QueueFullError(everyone, _retry_after(session, tenant, own, shares.workers))
    if own >= most:
        raise TenantQueueFullError(own, _retry_after(session, tenant, own, shares.workers))


def _retry_after(session: Session, tenant: str, own: int, workers: int) -> int:
    """Seconds until a new job of the tenant would have its turn, as far as one can tell now.

    Before it are its own and, since turns are taken, as many of each other one at most.
    """
    others = session.scalars(
        select(func.count())
        .select_from(JobRow)
        .where(JobRow.state == JobState.QUEUED, JobRow.tenant != tenant)
        .group_by(JobRow.tenant)
    )
    before = own + sum(min(count, own + 1) for count in others)
    seconds = _median_seconds(session) * before / workers
    return min(max(math.ceil(seconds), _SHORTEST), _LONGEST)


def _median_seconds(session: Session) -> float:
    """Of the jobs that were done last; a clock that was set in between gives none below 0."""
    last = session.execute(
        select(JobRow.started, JobRow.ended, JobRow.state)
        .where(JobRow.ended.is_not(None))
        .order_by(JobRow.ended.desc())
        .limit(_LOOKED_AT)
    )
    times = [
        max(0.0, ended - started)
        for started, ended, state in last
        # Without a begin: a stored result, or one that was cancelled as it waited.
        if started is not None and ended is not None and state is not JobState.CANCELLED
    ]
    return statistics.median(times) if times else _UNKNOWN_SECONDS


def _keyed(session: Session) -> tuple[str | None, str | None]:
    """The first and the last tenant with a key, by name; None where nobody has one."""
    live = ApiKeyRow.revoked.is_(None)
    return (
        session.scalar(select(func.min(ApiKeyRow.tenant)).where(live)),
        session.scalar(select(func.max(ApiKeyRow.tenant)).where(live)),
    )
