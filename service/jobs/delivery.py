"""A word to others that a job has ended, kept until it was heard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

LONGEST_URL = 2000
"""Characters of a webhook's address."""


@dataclass(frozen=True)
class Delivery:
    """One webhook of one job.

    ``id``       goes along, so that a receiver can tell a second try from a second event.
    ``attempt``  how often it was tried; ``due`` when it is next, Unix seconds.
    """

    id: str
    tenant: str
    job_id: str
    url: str
    attempt: int
    due: float


class DeliveryStore(Protocol):
    """Deliveries that wait.  They are made in the transaction that ends their job."""

    def due(self, limit: int) -> Sequence[Delivery]:
        """Those whose time has come, oldest first."""

    def confirm(self, delivery: Delivery) -> None: ...

    def postpone(self, delivery: Delivery, seconds: float, reason: str) -> None:
        """Count the attempt and try again later."""

    def give_up(self, delivery: Delivery, reason: str) -> None: ...
