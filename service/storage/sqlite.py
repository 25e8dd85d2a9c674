"""SQLite: one file, read by many threads and written by one at a time.

Write-ahead logging lets readers go on while one writes.  Writers of this process queue for the only
connection that writes, which is fair; those of others (``occluder keys``) wait for SQLite's lock.
Each takes the lock before it reads, so that what it has read stays true until it has written.

Every commit is on the disk before it is told (``synchronous=FULL``): a job that was answered 202
survives the loss of power.  That costs one flush a transaction, a few milliseconds beside the
seconds that a job takes.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session
from sqlalchemy.pool import NullPool

from service.errors import (
    DatabaseDamagedError,
    DiskFullError,
    NotReadyError,
    SettingsError,
)
from service.storage.database import Database, Topic
from service.storage.schema import migrate

_LOCK_SECONDS = 30
"""How long a transaction waits for its turn; each takes milliseconds."""

_READERS = 16
"""Connections that read; more threads wait for their turn.  Each may hold 2 MiB of pages."""

_LOG_BYTES = 16 << 20
"""What the write-ahead log is cut back to after it had to grow."""

_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
_FULL = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR_SHMSIZE)
_REFUSED = (
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_AUTH,
)
_PASSING = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_IOERR, *_REFUSED)


class SqliteDatabase(Database):
    """An open file.  Safe to use from any thread; see :meth:`open`."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._damaged = False
        pragmas = (
            "journal_mode = WAL",
            "synchronous = FULL",
            f"journal_size_limit = {_LOG_BYTES}",
            "foreign_keys = ON",
        )
        super().__init__(
            writer=_engine(file, pragmas, "BEGIN IMMEDIATE", connections=1),
            reader=_engine(file, ("query_only = ON",), "BEGIN", connections=_READERS),
        )

    @classmethod
    def open(cls, file: Path, *, may_be_new: bool = True) -> SqliteDatabase:
        """Check the file page by page, and bring it to the present schema; make it if it is new.

        Nobody but its owner may read a new one, nor the log beside it, which SQLite makes like it.
        Raises :class:`~service.errors.DatabaseDamagedError` where a page cannot be read or there
        is nothing in a file that may not be new, and :class:`~service.errors.SettingsError` where
        the file cannot be used: no right, a disk of another machine, a newer version's schema.
        """
        with suppress(OSError):  # SQLite says more of what is in the way
            file.touch(mode=0o600)
        database = cls(file)
        try:
            with database._raising_service_errors(at_start=True):
                _prepare(file, may_be_new)
        except BaseException:
            database.close()
            raise
        return database

    @property
    def damaged(self) -> bool:
        return self._damaged

    def clock(self) -> float:
        return time.time()

    def shared_clock(self) -> float:
        """That of the machine; it is never set, and begins anew with the machine."""
        return time.monotonic()

    @property
    def shared(self) -> bool:
        return False

    def do_without_flush(self, session: Session) -> None:
        """It is flushed all the same."""

    def lock(self, session: Session, name: str) -> bool:
        """One writes at a time."""
        return True

    def tell(self, session: Session, topic: Topic, what: str = "") -> None:
        """Nobody shares it."""

    @contextmanager
    def _raising_service_errors(self, *, at_start: bool = False) -> Iterator[None]:
        """Turn what SQLite refuses into errors of the service; faults of ours pass through."""
        try:
            yield
        except PoolTimeoutError:
            raise NotReadyError(
                "the database is busier than it can bear", remedy="try again in a minute"
            ) from None
        except UnicodeDecodeError as error:  # of a name in the schema, within SQLite's own words
            self._damaged = True
            raise damage_error(self._file, "a name is not UTF-8") from error
        except DBAPIError as error:
            code = _code(error)
            kind = code & 0xFF  # the rest says more closely what went wrong
            self._damaged |= kind in _DAMAGE
            if kind in _DAMAGE:
                # Not the text that is none: it may be of another tenant.
                raise damage_error(
                    self._file, str(error.orig).partition(" with text")[0]
                ) from error
            if kind in _FULL or code in _FULL:
                raise DiskFullError(
                    "there is no room for the database",
                    remedy=f"make room on the disk of '{self._file.parent}'; nothing was lost",
                ) from error
            if at_start and kind in _REFUSED:
                raise SettingsError(
                    f"the database '{self._file}' cannot be opened ({error.orig}); "
                    "check that its folder is there and may be written"
                ) from error
            if kind in _PASSING:
                raise NotReadyError(
                    f"the database cannot be used at the moment ({error.orig})",
                    remedy="try again in a minute",
                ) from error
            raise


def _code(error: DBAPIError) -> int:
    """SQLite's, extended; the driver has none for a stored text that is not UTF-8."""
    own = sqlite3.SQLITE_ERROR
    if isinstance(error.orig, sqlite3.OperationalError):
        own = sqlite3.SQLITE_CORRUPT
    return getattr(error.orig, "sqlite_errorcode", own)


def damage_error(file: Path, what: str) -> DatabaseDamagedError:
    return DatabaseDamagedError(
        f"the database '{file}' is damaged ({what})",
        remedy="stop the service, keep a copy of the file, and put back a backup or what "
        "'sqlite3 occluder.db .recover' saves of it",
    )


def _loss_error(file: Path) -> DatabaseDamagedError:
    return DatabaseDamagedError(
        f"the database '{file}' is gone, and blobs that it named are there",
        remedy="put back a backup of it; or, if nothing of them is wanted, remove the whole folder",
    )


def _engine(file: Path, pragmas: tuple[str, ...], begin: str, *, connections: int = 0) -> Engine:
    """Connections that are set up by pragmas and whose transactions begin in one way.

    ``connections`` are kept and shared; with 0, each is closed after use.
    """
    pool: dict[str, Any] = {"poolclass": NullPool}
    if connections:
        pool = {"pool_size": connections, "max_overflow": 0, "pool_timeout": _LOCK_SECONDS}
    engine = create_engine(
        URL.create("sqlite", database=str(file)), connect_args={"timeout": _LOCK_SECONDS}, **pool
    )

    @event.listens_for(engine, "connect")
    def _set_up(connection: sqlite3.Connection, _: object) -> None:
        connection.isolation_level = None  # or the driver begins transactions as it likes
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        connection.exec_driver_sql(begin)

    return engine


def _prepare(file: Path, may_be_new: bool) -> None:
    """Check all pages and migrate, by a connection of its own.

    Without foreign keys, since a migration that makes a table anew would delete what points at it.
    """
    engine = _engine(file, ("journal_mode = WAL", "synchronous = FULL"), "BEGIN IMMEDIATE")
    with engine.begin() as connection:
        mode = connection.exec_driver_sql("PRAGMA journal_mode").scalar_one()
        if mode != "wal":
            raise SettingsError(
                f"the disk of '{file}' does not allow write-ahead logging; "
                "put the data folder on a disk of this machine"
            )
        found = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar_one()
        if found != "ok":
            raise damage_error(file, found.splitlines()[-1])
        if (
            not may_be_new
            and connection.exec_driver_sql("SELECT 1 FROM sqlite_master").first() is None
        ):
            raise _loss_error(file)
        migrate(connection)
        if connection.exec_driver_sql("PRAGMA foreign_key_check").first() is not None:
            raise damage_error(file, "a row names another that is not there")
