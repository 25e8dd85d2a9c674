"""Requests that are sent again: the same one is done once, and answered as it was.

As draft-ietf-httpapi-idempotency-key-header has it.  What was refused has changed nothing and is
not kept: sent again under the same key it is judged anew.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

KEPT_SECONDS = 86_400.0
"""For which an answer is kept, from when it was given."""


@dataclass(frozen=True)
class KeyedRequest:
    """A request under a key of the caller's own making.

    ``fingerprint``  equal for the same request: what is asked, and of what.
    """

    tenant: str
    key: str
    fingerprint: str


@dataclass(frozen=True)
class Answer:
    """An answer as it is kept.

    ``headers``  those that are of this answer alone.
    ``job_id``   of the job that it is about, where it took one in.
    """

    status: int
    headers: Mapping[str, str] = field(default_factory=dict)
    body: bytes = b""
    job_id: str | None = None


class Answers(Protocol):
    """What was answered to requests under a key."""

    def once(self, request: KeyedRequest, work: Callable[[], Answer]) -> tuple[Answer, bool]:
        """Do a request, or give the answer that it had before; whether it had.

        All that ``work`` does to the database, in this thread, and its answer are one transaction:
        a crash leaves both or neither.  What it raises undoes all, the key is free again.  Raises
        :class:`~service.errors.RequestUnderWayError` while another does the same, and
        :class:`~service.errors.IdempotencyKeyReusedError` for a key of another request.
        """

    def known(self, tenant: str, key: str) -> bool:
        """Whether an answer is kept under a key."""

    def afterwards(self, do: Callable[[], None]) -> None:
        """Do a thing once what was done before it can be seen by others: now, or after the commit
        of :meth:`once`."""

    def expire(self, before: float) -> int:
        """Forget answers that were given before a time, Unix seconds; how many."""
