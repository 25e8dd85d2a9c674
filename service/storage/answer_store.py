"""Answers in the database; see :class:`service.idempotency.Answers` for what is promised.

The primary key, tenant and key, decides which of two requests is the first.  That a key is being
worked on is known in memory, and to other servers by a lock of the transaction: nothing of that has
to survive, since a crash undoes the work.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from service.errors import IdempotencyKeyReusedError, RequestUnderWayError
from service.idempotency import KEPT_SECONDS, Answer, KeyedRequest
from service.storage.database import Database, dialect_insert, retried
from service.storage.tables import IdempotencyKeyRow


class SqlAnswerStore:
    """Answers by tenant and key, each written with what it tells of."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock
        self._lock = threading.Lock()
        self._under_way: set[tuple[str, str]] = set()

    def once(self, request: KeyedRequest, work: Callable[[], Answer]) -> tuple[Answer, bool]:
        with self._alone(request):
            return self._once(request, work)

    @retried
    def _once(self, request: KeyedRequest, work: Callable[[], Answer]) -> tuple[Answer, bool]:
        now = self._clock()
        with self._database.together() as session:
            if not self._database.lock(session, f"answer {request.tenant} {request.key}"):
                raise RequestUnderWayError(request.key)
            if not _claim(session, request, now):
                return _earlier(session, request), True
            answer = work()
            row = session.get_one(IdempotencyKeyRow, (request.tenant, request.key))
            row.status, row.headers = answer.status, dict(answer.headers)
            row.body, row.job_id = answer.body, answer.job_id
        return answer, False

    def known(self, tenant: str, key: str) -> bool:
        with self._database.reading() as session:
            row = session.get(IdempotencyKeyRow, (tenant, key))
            return row is not None and not _is_over(row.created, self._clock())

    def afterwards(self, do: Callable[[], None]) -> None:
        self._database.afterwards(do)

    @retried
    def expire(self, before: float) -> int:
        old = IdempotencyKeyRow.created < before
        with self._database.writing() as session:
            query = select(func.count()).select_from(IdempotencyKeyRow).where(old)
            count = session.scalars(query).one()
            session.execute(delete(IdempotencyKeyRow).where(old))
        return count

    @contextmanager
    def _alone(self, request: KeyedRequest) -> Iterator[None]:
        name = (request.tenant, request.key)
        with self._lock:
            if name in self._under_way:
                raise RequestUnderWayError(request.key)
            self._under_way.add(name)
        try:
            yield
        finally:
            with self._lock:
                self._under_way.remove(name)


def _claim(session: Session, request: KeyedRequest, now: float) -> bool:
    """Whether the key is this request's from now on; an answer that is over gives way."""
    mine = (IdempotencyKeyRow.tenant == request.tenant, IdempotencyKeyRow.key == request.key)
    session.execute(
        delete(IdempotencyKeyRow).where(*mine, IdempotencyKeyRow.created <= now - KEPT_SECONDS)
    )
    row = {
        "tenant": request.tenant, "key": request.key, "fingerprint": request.fingerprint,
        "created": now,
    }  # fmt: skip
    claimed = dialect_insert(session)(IdempotencyKeyRow).values(row).on_conflict_do_nothing()
    return session.scalars(claimed.returning(IdempotencyKeyRow.key)).first() is not None


def _earlier(session: Session, request: KeyedRequest) -> Answer:
    row = session.get_one(IdempotencyKeyRow, (request.tenant, request.key))
    if row.fingerprint != request.fingerprint:
        raise IdempotencyKeyReusedError(request.key)
    assert row.status is not None  # else its transaction was undone, and the row with it
    return Answer(row.status, row.headers or {}, row.body or b"", row.job_id)


def _is_over(created: float, now: float) -> bool:
    return created <= now - KEPT_SECONDS
