"""The database, whichever it is: transactions that read, and transactions that write.

Two stand behind this: a SQLite file of one server (:mod:`service.storage.sqlite`), and a PostgreSQL
database that several share (:mod:`service.storage.postgres`).  The stores are written for both:

- What they change they lock first, by ``with_for_update``.  SQLite leaves that out, since it has
  one writer at a time.
- What two may make at once, a constraint decides: an insert that is ignored, or an upsert.
- What a database undoes for the sake of another transaction is done again, by :func:`retried`.
"""

from __future__ import annotations

import random
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import StrEnum
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

from sqlalchemy import Engine, text
from sqlalchemy.orm import Session, sessionmaker

from service.errors import NotReadyError, ServiceError

_TRIES = 12
_LONGEST_PAUSE = 0.2  # seconds between two tries

T = TypeVar("T")
P = ParamSpec("P")


class Topic(StrEnum):
    """What servers that share a database tell each other."""

    QUEUED = "queued"
    """A job waits that did not."""
    ENDED = "ended"
    """A job has ended; its id goes with it."""


class UndoneError(Exception):
    """The database has undone a transaction for the sake of another; done again, it may succeed."""


@dataclass
class _Joined:
    """A transaction that others take part in, and what is to be done when it is committed."""

    session: Session
    afterwards: list[Callable[[], None]] = field(default_factory=list)


class Database(ABC):
    """An open database.  Safe to use from any thread."""

    def __init__(self, writer: Engine, reader: Engine) -> None:
        self._writer, self._reader = writer, reader
        self._write, self._read = sessionmaker(writer), sessionmaker(reader)
        self._joined: ContextVar[_Joined | None] = ContextVar("joined", default=None)

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A transaction that sees one state of things, whatever others write meanwhile."""
        joined = self._joined.get()
        if joined is not None:
            yield joined.session
            return
        with self._raising_service_errors(), self._read.begin() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """A transaction that writes; an error undoes all of it.

        Where others write beside, what it reads stays true only for rows that it has locked.
        Raises :class:`UndoneError`, for :func:`retried` to catch.
        """
        joined = self._joined.get()
        if joined is not None:
            with self._raising_service_errors(), joined.session.begin_nested():
                yield joined.session
            return
        with self._raising_service_errors(), self._write.begin() as session:
            yield session

    @contextmanager
    def together(self) -> Iterator[Session]:
        """A transaction that whatever this thread reads and writes within the block is part of.

        So what several steps write is there, or none of it.
        """
        with self.writing() as session:
            joined = _Joined(session)
            token = self._joined.set(joined)
            try:
                yield session
            finally:
                self._joined.reset(token)
        for do in joined.afterwards:
            do()

    def afterwards(self, do: Callable[[], None]) -> None:
        """Do a thing at once; within :meth:`together`, after its commit, and never if it fails."""
        joined = self._joined.get()
        if joined is None:
            do()
        else:
            joined.afterwards.append(do)

    def again(self, work: Callable[[], T]) -> T:
        """Do something that may be undone, until it is not; within :meth:`together` but once.

        The whole of :meth:`together` is undone then, and it is for its caller to do that again.
        Raises :class:`~service.errors.NotReadyError` after some tries.
        """
        if self._joined.get() is not None:
            return work()
        for number in range(_TRIES):
            try:
                return work()
            except UndoneError as error:
                if number == _TRIES - 1:
                    raise NotReadyError(
                        f"the database is too busy ({error})", remedy="try again in a minute"
                    ) from error
            time.sleep(random.uniform(0.0, min(_LONGEST_PAUSE, 0.005 * 2.0**number)))
        raise AssertionError("unreachable")

    def is_sound(self) -> bool:
        """Whether it can be read, and no damage was met since it was opened."""
        with suppress(ServiceError), self.reading() as session:
            session.execute(text("SELECT version_num FROM alembic_version")).one()
            return not self.damaged
        return False

    def close(self) -> None:
        self._reader.dispose()
        self._writer.dispose()

    @property
    @abstractmethod
    def damaged(self) -> bool:
        """Whether damage was met since it was opened."""

    @abstractmethod
    def clock(self) -> float:
        """The time of day, Unix seconds, by a clock that all have who share the database."""

    @abstractmethod
    def shared_clock(self) -> float:
        """Seconds, for pauses, by a clock that all have who share the database."""

    @property
    @abstractmethod
    def shared(self) -> bool:
        """Whether other servers may use it as well."""

    @abstractmethod
    def do_without_flush(self, session: Session) -> None:
        """Let the commit of this transaction be told before it is on the disk."""

    @abstractmethod
    def lock(self, session: Session, name: str) -> bool:
        """Lock a name until the transaction ends; whether no other transaction has it locked."""

    @abstractmethod
    def tell(self, session: Session, topic: Topic, what: str = "") -> None:
        """Let the others know when the transaction is committed."""

    @abstractmethod
    def _raising_service_errors(self) -> AbstractContextManager[None]:
        """Turn what the database refuses into errors of the service; faults of ours pass."""


class OnDatabase(Protocol):
    """A store."""

    @property
    def _database(self) -> Database: ...


S = TypeVar("S", bound=OnDatabase)


def retried(method: Callable[Concatenate[S, P], T]) -> Callable[Concatenate[S, P], T]:
    """A method of a store, all of it one transaction, done again where that was undone."""

    @wraps(method)
    def whole(store: S, /, *given: P.args, **named: P.kwargs) -> T:
        return store._database.again(lambda: method(store, *given, **named))

    return whole


def dialect_insert(session: Session) -> Callable[..., Any]:
    """The ``insert`` of this database that knows of conflicts."""
    if session.get_bind().dialect.name == "postgresql":
        from sqlalchemy.dialects.postgresql import insert

        return insert
    from sqlalchemy.dialects.sqlite import insert as sqlite_insert

    return sqlite_insert
