"""Webhooks that wait and those that are told of in a log; :mod:`service.jobs.deliveries` says what
is promised.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from sqlalchemy import delete, or_, select
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
from service.storage.database import Database
from service.storage.rows import by_name
from service.storage.tables import DeliveryAttemptRow, DeliveryRow, JobRow

_ATTEMPTS_KEPT = 100
"""Of a delivery: twice as many as one may have unless it is asked for by hand."""


class SqlDeliveryStore:
    """Deliveries, each of which was put down by the transaction that ended its job.

    One waits from a time to a later one.  Where the clock shows a time before both, it was set
    back, and the wait is over: else a webhook would wait as long as the clock was set back.
    """

    def __init__(self, database: Database, clock: Callable[[], float] = time.time) -> None:
        self._database = database
        self._clock = clock

    def due(self, limit: int) -> Sequence[Delivery]:
        now = self._clock()
        query = (
            select(DeliveryRow)
            .where(
                DeliveryRow.state == DeliveryState.WAITING,
                or_(DeliveryRow.due <= now, DeliveryRow.since > now),
            )
            .order_by(DeliveryRow.due, DeliveryRow.number)
            .limit(limit)
        )
        with self._database.reading() as session:
            return [_delivery_of(row) for row in session.scalars(query)]

    def confirm(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        self._note(delivery, attempt, DeliveryState.DELIVERED)

    def postpone(self, delivery: Delivery, attempt: DeliveryAttempt, seconds: float) -> None:
        self._note(delivery, attempt, DeliveryState.WAITING, seconds)

    def give_up(self, delivery: Delivery, attempt: DeliveryAttempt) -> None:
        self._note(delivery, attempt, DeliveryState.GIVEN_UP)

    def _note(
        self,
        delivery: Delivery,
        attempt: DeliveryAttempt,
        state: DeliveryState,
        seconds: float = 0.0,
    ) -> None:
        """Count an attempt; nothing where the job has been forgotten meanwhile."""
        with self._database.writing() as session:
            row = session.scalars(select(DeliveryRow).where(DeliveryRow.id == delivery.id)).first()
            if row is None:
                return
            session.add(DeliveryAttemptRow(delivery_number=row.number, **asdict(attempt)))
            session.flush()
            _forget_old(session, row.number)
            if row.redelivered == delivery.redelivered:
                row.state, row.reason, row.attempt = state, attempt.reason or None, row.attempt + 1
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

    def redeliver(self, tenant: str | None, delivery_id: str) -> DeliveryRecord:
        with self._database.writing() as session:
            row = _find(session, tenant, delivery_id)
            row.state, row.attempt, row.redelivered = DeliveryState.WAITING, 0, row.redelivered + 1
            row.since = row.due = self._clock()
            return _record_of(session, row)


def _find(session: Session, tenant: str | None, delivery_id: str) -> DeliveryRow:
    row = session.scalars(select(DeliveryRow).where(DeliveryRow.id == delivery_id)).first()
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
    }
    return Delivery(**by_name(row, Delivery, but=kept_otherwise), **kept_otherwise)
