"""Webhooks: words to others that a job has ended, what came of them, and how they are kept.

Every method of a store is one transaction, safe to call from any thread, and raises as those of
:mod:`service.jobs.stores` do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol


class DeliveryState(StrEnum):
    """Whether a webhook has still to be sent."""

    WAITING = "waiting"
    DELIVERED = "delivered"
    GIVEN_UP = "given_up"


class WebhookOutcome(StrEnum):
    """What a try came to."""

    HEARD = "heard"
    FAILED = "failed"
    GIVEN_UP = "given_up"


@dataclass(frozen=True)
class Delivery:
    """One webhook of one job.

    ``id``       goes along, the same at every try and however often it is sent by hand, so that a
                 receiver can tell a second try from a second event.
    ``attempt``  how often it was tried since it was made, or since it was asked for by hand.
    ``due``      when it is next, Unix seconds.
    ``redelivered``  how often it was asked for by hand.
    ``request_id``, ``trace``  of the request that the job came by.
    ``owner``    who sends it just now.
    """

    id: str
    tenant: str
    job_id: str
    url: str
    attempt: int
    due: float
    redelivered: int = 0
    request_id: str | None = None
    trace: str | None = None
    owner: str | None = None


@dataclass(frozen=True)
class DeliveryAttempt:
    """What came of a try.

    ``at``       when it began, Unix seconds; ``milliseconds`` that it took.
    ``status``   that the receiver answered with; None where it did not.
    ``reason``   why it was not heard; empty when it was.
    ``excerpt``  of the answer's text; None where there is none that may be shown.
    """

    at: float
    milliseconds: float
    status: int | None = None
    reason: str = ""
    excerpt: str | None = None


@dataclass(frozen=True)
class DeliveryRecord:
    """A webhook as the log has it, with its last tries, the oldest first.

    ``number``  rises with every delivery: the order of lists.
    """

    delivery: Delivery
    state: DeliveryState
    number: int
    created: float
    attempts: tuple[DeliveryAttempt, ...]


@dataclass(frozen=True)
class DeliveryFilter:
    """Which deliveries to list: all that are given must hold."""

    state: DeliveryState | None = None
    job_id: str | None = None


@dataclass(frozen=True)
class DeliveryPage:
    """Deliveries, newest first, and the cursor of the next page; None on the last."""

    records: tuple[DeliveryRecord, ...]
    cursor: int | None


class DeliveryStore(Protocol):
    """Deliveries that wait.  They are made in the transaction that ends their job."""

    def due(self, limit: int) -> Sequence[Delivery]:
        """The deliveries whose time has come, oldest first."""

    def claim(
        self, deliveries: Sequence[Delivery], owner: str, seconds: float
    ) -> Sequence[Delivery]:
        """Those that this sender has from now on; where it says nothing for so long, others may."""

    def release_all(self) -> None:
        """Let all be sent anew that somebody claimed, for a sender that has no others beside it."""

    # Each of these writes down a try.  What it decides counts only if nobody has asked for another
    # one by hand since it began, or claimed it.

    def confirm(self, delivery: Delivery, attempt: DeliveryAttempt) -> None: ...

    def postpone(self, delivery: Delivery, attempt: DeliveryAttempt, seconds: float) -> None:
        """Count the attempt and try again later."""

    def give_up(self, delivery: Delivery, attempt: DeliveryAttempt) -> None: ...


class DeliveryLog(Protocol):
    """Deliveries as people look at them; a tenant of None sees all."""

    def page(
        self, tenant: str | None, wanted: DeliveryFilter, *, before: int | None, limit: int
    ) -> DeliveryPage: ...

    def record(self, tenant: str | None, delivery_id: str) -> DeliveryRecord:
        """Raises :class:`~service.errors.NotFoundError`."""

    def redeliver(self, tenant: str | None, delivery_id: str) -> DeliveryRecord:
        """Let it be sent at once, and tried as often as a new one, whatever became of it before.

        Raises :class:`~service.errors.NotFoundError`.
        """


@dataclass(frozen=True)
class SecretAge:
    """How often a tenant's secret was rotated, and until when the one before is good as well."""

    generation: int = 0
    overlap_ends: float = 0.0


class SecretAges(Protocol):
    """Which secret each tenant's webhooks are signed with; the secrets are kept elsewhere."""

    def age(self, tenant: str) -> SecretAge: ...

    def rotate(self, tenant: str, overlap_seconds: float) -> SecretAge:
        """From now on by a new secret, and for so long by the one before as well."""
