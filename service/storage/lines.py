"""The lines before the workers, as the database has them: who is next, and how many stand where.

The row of a tenant counts its jobs that wait and run, so that neither a submission nor a claim
counts jobs.  What a claim costs grows with the tenants that wait, and neither with the jobs of one
nor with tenants that have none: it looks at the first job of each priority of each tenant that
waits, by an index.

Several servers claim at a time where they share the database.  Each takes the first job that no
other has locked.  The tenant's row comes last, and its count is held under the limit there, so that
it is locked for the length of a commit alone.  Of two that claim at once it is left to chance which
has whose turn.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from itertools import islice
from typing import Any

from sqlalchemy import ColumnElement, Row, func, or_, select, text, update
from sqlalchemy.orm import Session

from service.errors import NotReadyError, QueueFullError, TenantQueueFullError
from service.jobs.job import JobState, Priority
from service.jobs.turns import Line, Shares, chosen, in_order, jobs_before, place
from service.storage.database import dialect_insert
from service.storage.tables import ApiKeyRow, DeploymentRow, JobRow, LineRow
from service.storage.waits import LONGEST_PAUSE

_ROUNDS = 3
"""How often a claim looks anew where others took what it saw."""

_LOOKED_AT = 200
"""Jobs that ended last, of which the speed of the queue is told."""

_UNKNOWN_SECONDS = 5.0
"""Of a job, where none has ended yet."""

_SHORTEST, _LONGEST = 1, 600
"""Seconds that a refused client is told to wait: further ahead nobody knows."""

_FARTHEST = 10_000
"""Jobs of a tenant among which a place is told: to find one takes the longer the farther it is."""

_FIRST_OF = """
        SELECT number FROM jobs
        WHERE state = 'queued' AND tenant = lines.tenant AND priority = '{}'{}
        ORDER BY number LIMIT 1"""
_DUE = " AND (due <= :now OR due > :far)"

# Words of the index are written out: what a statement is told later cannot be planned with.
_HEADS = text(
    f"""
    WITH heads AS MATERIALIZED (
        SELECT tenant, turn, streak,
               ({_FIRST_OF.format(Priority.INTERACTIVE, _DUE)}) AS interactive,
               ({_FIRST_OF.format(Priority.BULK, _DUE)}) AS bulk
        FROM lines WHERE waiting > 0 AND (running < :most OR tenant = :unlimited OR :all_may)
    )
    SELECT tenant, interactive, bulk, streak FROM heads
    WHERE interactive IS NOT NULL OR bulk IS NOT NULL
    ORDER BY turn, CASE WHEN bulk IS NULL OR interactive < bulk THEN interactive ELSE bulk END
    LIMIT 16
    """
)

_LINES = text(
    f"""
    SELECT tenant, turn, streak, waiting,
           ({_FIRST_OF.format(Priority.INTERACTIVE, "")}) AS interactive,
           ({_FIRST_OF.format(Priority.BULK, "")}) AS bulk
    FROM lines WHERE waiting > 0
    """
)


def take_turn(session: Session, shares: Shares, now: float, release: str | None) -> JobRow | None:
    """The job that is next, locked, and its tenant's turn noted; None where no one may have one.

    ``now``      by the clock of pauses.
    ``release``  of whoever asks; None where any will do.

    Raises :class:`~service.errors.NotReadyError` where another release works.
    """
    if release is not None:
        _check_release(session, release)
    limits = _Limits.of(session, shares)
    for _ in range(_ROUNDS):
        asked = {"now": now, "far": now + LONGEST_PAUSE, **vars(limits)}
        heads = session.execute(_HEADS, asked).all()
        if not heads:
            return None
        for head in heads:
            row = _begin(session, head, limits, now)
            if row is not None:
                return row
    return None


def take_job(
    session: Session, shares: Shares, now: float, release: str | None, job_id: str
) -> JobRow | None:
    """One job, locked, and its tenant's turn noted; None where it may not begin, or has.

    Arguments and errors are those of :func:`take_turn`.
    """
    if release is not None:
        _check_release(session, release)
    row = session.scalars(
        select(JobRow)
        .where(JobRow.id == job_id, JobRow.state == JobState.QUEUED, _is_due(now))
        .with_for_update(of=JobRow, skip_locked=True)
    ).first()
    if row is None:
        return None
    streak = 0
    if row.priority is not Priority.BULK and _first(session, row.tenant, Priority.BULK, 1):
        before = select(LineRow.streak).where(LineRow.tenant == row.tenant)
        streak = session.scalars(before).one() + 1
    limits = _Limits.of(session, shares)
    return row if _count_begun(session, row.tenant, streak, limits) else None


def next_in_turn(session: Session, shares: Shares, now: float, limit: int) -> list[int]:
    """Numbers of the jobs that would begin next if so many began at once; in order.

    Only those that may begin now: what is in a pause, or beyond what its tenant may have at a time,
    is not among them.
    """
    if limit < 1:
        return []
    limits = _Limits.of(session, shares)
    found: list[int] = []
    lines = session.execute(
        select(LineRow.tenant, LineRow.turn, LineRow.streak, LineRow.running)
        .where(LineRow.waiting > 0)
        .order_by(LineRow.turn, LineRow.tenant)
    ).all()
    heads: list[tuple[int, int, int, Iterator[int]]] = []
    for line in lines:
        if len(heads) >= limit and line.turn > heads[-1][0]:
            break  # so many others have a turn before it
        room = limits.most - line.running if limits.bind(line.tenant) else limit
        interactive = _first(session, line.tenant, Priority.INTERACTIVE, limit, now)
        bulk = _first(session, line.tenant, Priority.BULK, limit, now)
        own = in_order(interactive, bulk, line.streak)
        turns: Iterator[int] = islice(own, max(0, min(room, limit)))
        first = next(turns, None)
        if first is not None:
            # As _HEADS: of tenants whose turn is the same, who has waited longest is the first.
            heads.append((line.turn, min(*interactive[:1], *bulk[:1], first), first, turns))
    heapify(heads)
    last = lines[-1].turn if lines else 0
    while heads and len(found) < limit:
        *_, number, turns = heappop(heads)
        found.append(number)
        following, last = next(turns, None), last + 1
        if following is not None:
            heappush(heads, (last, following, following, turns))
    return found


@dataclass(frozen=True)
class _Limits:
    """How many jobs of a tenant may be done at a time.

    ``unlimited``  the tenant that may have all, as no other has a key.
    ``all_may``    whether all may have all, as no one has a key.
    """

    most: int
    unlimited: str | None = None
    all_may: bool = False

    @classmethod
    def of(cls, session: Session, shares: Shares) -> _Limits:
        if shares.running is not None:
            return cls(shares.most_running)
        least, greatest = _keyed(session)
        only = least if least == greatest else None
        return cls(shares.most_running, unlimited=only, all_may=least is None)

    def bind(self, tenant: str) -> bool:
        return not self.all_may and tenant != self.unlimited


def _begin(session: Session, head: Row[Any], limits: _Limits, now: float) -> JobRow | None:
    """The job of a tenant whose turn it is; None where others have taken all that it may have."""
    number, streak = chosen(head.interactive, head.bulk, head.streak)
    row = _lock_first(session, head.tenant, bulk=number == head.bulk, now=now)
    if row is None:
        return None
    return row if _count_begun(session, head.tenant, streak, limits) else None


def _count_begun(session: Session, tenant: str, streak: int, limits: _Limits) -> bool:
    """Note a tenant's turn; False where as many of its jobs run as may."""
    turn = select(func.coalesce(func.max(LineRow.turn), 0) + 1).scalar_subquery()
    line = (
        update(LineRow)
        .where(LineRow.tenant == tenant)
        .values(turn=turn, streak=streak, waiting=LineRow.waiting - 1, running=LineRow.running + 1)
        .execution_options(synchronize_session=False)
    )
    if limits.bind(tenant):
        line = line.where(LineRow.running < limits.most)
    return session.execute(line.returning(LineRow.tenant)).first() is not None


def _lock_first(session: Session, tenant: str, *, bulk: bool, now: float) -> JobRow | None:
    priority = Priority.BULK if bulk else Priority.INTERACTIVE
    return session.scalars(
        select(JobRow)
        .where(
            JobRow.state == JobState.QUEUED,
            JobRow.tenant == tenant,
            JobRow.priority == priority,
            _is_due(now),
        )
        .order_by(JobRow.number)
        .limit(1)
        .with_for_update(of=JobRow, skip_locked=True)
    ).first()


def _is_due(now: float) -> ColumnElement[bool]:
    """Whether a job's pause is over; one that is longer than any was given by another clock."""
    return or_(JobRow.due <= now, JobRow.due > now + LONGEST_PAUSE)


def _check_release(session: Session, release: str) -> None:
    works = session.scalars(select(DeploymentRow.release)).one()
    if works != release:
        raise NotReadyError(
            f"the database is set up for release {works}, and this one, {release}, gets no work",
            remedy=f"install {works} here, or run 'occluder migrate' of {release}",
        )


def join_line(session: Session, tenant: str, most: int) -> bool:
    """Count one more job that waits, if no more than ``most`` of the tenant's wait then."""
    joins = dialect_insert(session)(LineRow).values(
        tenant=tenant, turn=0, streak=0, waiting=1, running=0
    )
    joins = joins.on_conflict_do_update(
        index_elements=[LineRow.tenant],
        set_={"waiting": LineRow.waiting + 1},
        where=LineRow.waiting < most,
    )
    return session.scalars(joins.returning(LineRow.tenant)).first() is not None


def move_in_line(session: Session, tenant: str, *, waiting: int = 0, running: int = 0) -> None:
    """Count that so many more jobs of a tenant wait or run."""
    session.execute(
        update(LineRow)
        .where(LineRow.tenant == tenant)
        .values(waiting=LineRow.waiting + waiting, running=LineRow.running + running)
        .execution_options(synchronize_session=False)
    )


def counted(session: Session) -> tuple[int, int]:
    """Jobs that wait and jobs that run, of all tenants."""
    waiting, running = session.execute(
        select(
            func.coalesce(func.sum(LineRow.waiting), 0),
            func.coalesce(func.sum(LineRow.running), 0),
        )
    ).one()
    return int(waiting), int(running)


def first_places(session: Session, tenant: str | None, limit: int) -> dict[int, int]:
    """Places in the queue by number, the first of a tenant's jobs or of all; from 1, in order.

    Limits and pauses are left aside.
    """
    lines = _lines(session)
    places: dict[int, int] = {}
    for line in lines:
        if tenant not in (None, line.tenant):
            continue
        interactive = _first(session, line.tenant, Priority.INTERACTIVE, limit)
        bulk = _first(session, line.tenant, Priority.BULK, limit)
        others = [one for one in lines if one is not line]
        for before, number in enumerate(in_order(interactive, bulk, line.streak)):
            if before == limit:
                break
            places[number] = place(before, line, others)
    return dict(sorted(places.items(), key=lambda one: one[1])[:limit])


def place_of(session: Session, number: int) -> int | None:
    """As :func:`first_places` has it; None where the job does not wait, or far behind."""
    row = session.get(JobRow, number)
    if row is None or row.state is not JobState.QUEUED:
        return None
    lines = {line.tenant: line for line in _lines(session)}
    mine = lines.pop(row.tenant, None)
    if mine is None:
        return None
    same = _count(session, row.tenant, row.priority, before=number)
    other = next(one for one in Priority if one is not row.priority)
    before = jobs_before(row.priority, same, _count(session, row.tenant, other), mine.streak)
    return None if same >= _FARTHEST else place(before, mine, lines.values())


def _lines(session: Session) -> list[Line]:
    lines = []
    for row in session.execute(_LINES):
        heads = [one for one in (row.interactive, row.bulk) if one is not None]
        if heads:
            lines.append(Line(row.tenant, row.turn, min(heads), row.waiting, row.streak))
    return lines


def _first(
    session: Session, tenant: str, priority: Priority, limit: int, now: float | None = None
) -> Sequence[int]:
    """The first of a tenant's jobs that wait, by number; of those in no pause where ``now`` is
    told."""
    query = select(JobRow.number).where(*_waits(tenant, priority)).order_by(JobRow.number)
    if now is not None:
        query = query.where(_is_due(now))
    return session.scalars(query.limit(limit)).all()


def _count(session: Session, tenant: str, priority: Priority, before: int | None = None) -> int:
    """No further than anybody is told."""
    query = select(JobRow.number).where(*_waits(tenant, priority))
    if before is not None:
        query = query.where(JobRow.number < before)
    return session.scalars(
        select(func.count()).select_from(query.limit(_FARTHEST).subquery())
    ).one()


def _waits(tenant: str, priority: Priority) -> tuple[Any, ...]:
    return (
        JobRow.state == JobState.QUEUED, JobRow.tenant == tenant, JobRow.priority == priority,
    )  # fmt: skip


def check_room(session: Session, tenant: str, queue_limit: int, shares: Shares) -> int:
    """How many jobs of the tenant may wait.

    Raises :class:`~service.errors.QueueFullError`.  A tenant of whom nothing waits has always room
    for a job: others cannot shut it out.
    """
    own = session.scalars(select(LineRow.waiting).where(LineRow.tenant == tenant)).first() or 0
    least, greatest = _keyed(session)
    others = least is not None and (least, greatest) != (tenant, tenant)
    most = max(1, shares.most_waiting(queue_limit, others=others))
    if own == 0:
        return most
    everyone, _ = counted(session)
    if everyone >= queue_limit:
        raise QueueFullError(everyone, _retry_after(session, tenant, own, shares.workers))
    if own >= most:
        raise TenantQueueFullError(own, _retry_after(session, tenant, own, shares.workers))
    return most


def _retry_after(session: Session, tenant: str, own: int, workers: int) -> int:
    """Seconds until a new job of the tenant would have its turn, as far as one can tell now.

    Before it are its own and, since turns are taken, as many of each other one at most.
    """
    others = session.scalars(select(LineRow.waiting).where(LineRow.tenant != tenant))
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
