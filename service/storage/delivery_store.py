"""Webhooks that wait; see :class:`service.jobs.stores.DeliveryStore` for what is promised."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from sqlalchemy import or_, select

from service.jobs.stores import Delivery
from service.storage.database import Database
from service.storage.tables import DeliveryRow, DeliveryState


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

    def confirm(self, delivery: Delivery) -> None:
        self._count_attempt(delivery, DeliveryState.DELIVERED, None)

    def postpone(self, delivery: Delivery, seconds: float, reason: str) -> None:
        self._count_attempt(delivery, DeliveryState.WAITING, reason, seconds)

    def give_up(self, delivery: Delivery, reason: str) -> None:
        self._count_attempt(delivery, DeliveryState.GIVEN_UP, reason)

    def _count_attempt(
        self, delivery: Delivery, state: DeliveryState, reason: str | None, seconds: float = 0.0
    ) -> None:
        """Count an attempt; nothing where the job has been forgotten meanwhile."""
        with self._database.writing() as session:
            row = session.scalars(select(DeliveryRow).where(DeliveryRow.id == delivery.id)).first()
            if row is not None:
                row.state, row.reason, row.attempt = state, reason, row.attempt + 1
                row.since = self._clock()
                row.due = row.since + seconds


def _delivery_of(row: DeliveryRow) -> Delivery:
    return Delivery(
        id=row.id,
        tenant=row.job.tenant,
        job_id=row.job.id,
        url=row.url,
        attempt=row.attempt,
        due=row.due,
    )
