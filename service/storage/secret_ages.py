"""How old the secrets of webhooks are; :class:`service.jobs.deliveries.SecretAges` says more."""

from __future__ import annotations

from collections.abc import Callable

from service.jobs.deliveries import SecretAge
from service.storage.database import Database, retried
from service.storage.tables import WebhookSecretRow


class SqlSecretAges:
    """A row a tenant whose secret was rotated."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    def age(self, tenant: str) -> SecretAge:
        with self._database.reading() as session:
            row = session.get(WebhookSecretRow, tenant)
            return SecretAge() if row is None else _age_of(row)

    @retried
    def rotate(self, tenant: str, overlap_seconds: float) -> SecretAge:
        with self._database.writing() as session:
            row = session.get(WebhookSecretRow, tenant, with_for_update=True)
            if row is None:
                row = WebhookSecretRow(tenant=tenant, generation=0, overlap_ends=0.0)
                session.add(row)
            row.generation += 1
            row.overlap_ends = self._clock() + overlap_seconds
            return _age_of(row)


def _age_of(row: WebhookSecretRow) -> SecretAge:
    return SecretAge(row.generation, row.overlap_ends)
