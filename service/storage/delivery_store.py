"""Webhooks that wait and those that are told of in a log; :mod:`service.jobs.deliveries` says what
is promised.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from sqlalchemy import ColumnElement, Select, delete, or_, select, update
from sqlalchemy.orm import Session

from service.errors import NotFoundError
from service.jobs.deliveries import (
    Delivery,
    DeliveryAttempt,
    DeliveryFilter,
    DeliveryPage,
    DeliveryRecord,
    DeliveryState,
)
from service.storage.database import Database, retried
from service.storage.rows import by_name
from service.storage.tables import DeliveryAttemptRow, DeliveryRow, JobRow

_ATTEMPTS_KEPT = 100
"""Of a delivery: twice as many as one may have unless it is asked for by hand."""


class SqlDeliveryStore:
    """Deliveries, each of which was put down by the transaction that ended its job.

    One waits from a time to a later one.  Where the clock shows a time before both, it was set
    back, and the wait is over: else a webhook would wait as long as the clock was set back.
    """

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    def due(self, limit: int) -> Sequence[Delivery]:
        query = (
            select(DeliveryRow)
            .where(*_are_due(self._clock()))
            .order_by(DeliveryRow.due, DeliveryRow.number)
            .limit(limit)
        )
        with self._database.reading() as session:
            return [_delivery_of(row) for row in session.scalars(query)]

    @retried
    def claim(
        self, deliveries: Sequence[Delivery], owner: str, seconds: float
    ) -> Sequence[Delivery]:
        if not deliveries:
            return []
        now = self._clock()
        with self._database.writing() as session:
            rows = session.scalars(
                select(DeliveryRow)
                .where(DeliveryRow.id.in_([one.id for one in deliveries]), *_are_due(now))
                .order_by(DeliveryRow.due, DeliveryRow.number)
                .with_for_update(of=DeliveryRow, skip_locked=True)
            ).all()
            for row in rows:
                row.owner, row.since, row.due = owner, now, now + seconds
            return [_delivery_of(row) for row in rows]

    @retried
    def release_all(self) -> None:
        with self._database.writing() as session:
            session.execute(
                update(DeliveryRow)
                .where(DeliveryRow.state == DeliveryState.WAITING, DeliveryRow.owner.is_not(None))
                .values(owner=None, due=DeliveryRow.since)
            )

    def confirm(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        self._note(delivery, attempt, DeliveryState.DELIVERED)

    def postpone(self, delivery: Delivery, attempt: DeliveryAttempt, seconds: float) -> None:
        self._note(delivery, attempt, DeliveryState.WAITING, seconds)

    def give_up(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        self._note(delivery, attempt, DeliveryState.GIVEN_UP)

    @retried
    def _note(
        self,
        delivery: Delivery,
        attempt: DeliveryAttempt,
        state: DeliveryState,
        seconds: float = 0.0,
    ) -> None:
        """Count an attempt; nothing where the job has been forgotten meanwhile."""
        with self._database.writing() as session:
            row = session.scalars(_row(delivery.id).with_for_update(of=DeliveryRow)).first()
            if row is None:
                return
            session.add(DeliveryAttemptRow(delivery_number=row.number, **asdict(attempt)))
            session.flush()
            _forget_old(session, row.number)
            if (row.redelivered, row.owner) == (delivery.redelivered, delivery.owner):
                row.state, row.reason, row.attempt = state, attempt.reason or None, row.attempt + 1
                row.owner = None
                row.since = self._clock()
                row.due = row.since + seconds

    def page(
        self, tenant: str | None, wanted: DeliveryFilter, *, before: int | None, limit: int
    ) -> DeliveryPage:
        query = select(DeliveryRow).order_by(DeliveryRow.number.desc()).limit(limit + 1)
        if tenant is not None:
            query = query.where(DeliveryRow.job.has(JobRow.tenant == tenant))
        if wanted.job_id is not None:
            query = query.where(DeliveryRow.job.has(JobRow.id == wanted.job_id))
        if wanted.state is not None:
            query = query.where(DeliveryRow.state == wanted.state)
        if before is not None:
            query = query.where(DeliveryRow.number < before)
        with self._database.reading() as session:
            found = [_record_of(session, row) for row in session.scalars(query).all()]
        page = tuple(found[:limit])
        return DeliveryPage(page, page[-1].number if len(found) > limit else None)

    def record(self, tenant: str | None, delivery_id: str) -> DeliveryRecord:
        with self._database.reading() as session:
            return _record_of(session, _find(session, tenant, delivery_id))

    @retried
    def redeliver(self, tenant: str | None, delivery_id: str) -> DeliveryRecord:
        with self._database.writing() as session:
            row = _find(session, tenant, delivery_id, lock=True)
            row.state, row.attempt, row.redelivered = DeliveryState.WAITING, 0, row.redelivered + 1
            row.owner = None
            row.since = row.due = self._clock()
            return _record_of(session, row)


def _are_due(now: float) -> tuple[ColumnElement[bool], ...]:
    return (
        DeliveryRow.state == DeliveryState.WAITING,
        or_(DeliveryRow.due <= now, DeliveryRow.since > now),
    )


def _row(delivery_id: str) -> Select[DeliveryRow]:
    return select(DeliveryRow).where(DeliveryRow.id == delivery_id)


def _find(
    session: Session, tenant: str | None, delivery_id: str, *, lock: bool = False
) -> DeliveryRow:
    query = _row(delivery_id)
    row = session.scalars(query.with_for_update(of=DeliveryRow) if lock else query).first()
    if row is None or tenant not in (None, row.job.tenant):
        raise NotFoundError(
            f"there is no delivery '{delivery_id}'",
            remedy="GET /v1/deliveries lists them; they are forgotten with their jobs",
        )
    return row


def _forget_old(session: Session, delivery_number: int) -> None:
    rows = DeliveryAttemptRow
    latest = (
        select(rows.number)
        .where(rows.delivery_number == delivery_number)
        .order_by(rows.number.desc())
        .limit(_ATTEMPTS_KEPT)
    )
    session.execute(
        delete(rows).where(rows.delivery_number == delivery_number, rows.number.not_in(latest))
    )


def _record_of(session: Session, row: DeliveryRow) -> DeliveryRecord:
    tries = session.scalars(
        select(DeliveryAttemptRow)
        .where(DeliveryAttemptRow.delivery_number == row.number)
        .order_by(DeliveryAttemptRow.number)
    )
    return DeliveryRecord(
        delivery=_delivery_of(row),
        state=row.state,
        number=row.number,
        created=row.job.ended or row.since,
        attempts=tuple(DeliveryAttempt(**by_name(one, DeliveryAttempt)) for one in tries),
    )


def _delivery_of(row: DeliveryRow) -> Delivery:
    kept_otherwise: dict[str, Any] = {
        "tenant": row.job.tenant,
        "job_id": row.job.id,
        "request_id": row.job.request_id,
        "trace": row.job.trace,
    }
    return Delivery(**by_name(row, Delivery, but=kept_otherwise), **kept_otherwise)
