"""The database: one SQLite file, read by many threads and written by one at a time.

Write-ahead logging lets readers go on while one writes.  Writers of this process queue for the only
connection that writes, which is fair; those of others (``occluder keys``) wait for SQLite's lock.
Each takes the lock before it reads, so that what it has read stays true until it has written.

Every commit is on the disk before it is told (``synchronous=FULL``): a job that was answered 202
survives the loss of power.  That costs one flush a transaction, a few milliseconds beside the
seconds that a job takes.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import URL, Connection, Engine, create_engine, event, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session, sessionmaker
from sqlalchemy.pool import NullPool

from service.errors import (
    DatabaseDamagedError,
    DiskFullError,
    NotReadyError,
    ServiceError,
    SettingsError,
)

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

_SCRIPTS = Path(__file__).with_name("migrations")


@dataclass
class _Joined:
    """A transaction that others take part in, and what is to be done when it is committed."""

    session: Session
    afterwards: list[Callable[[], None]] = field(default_factory=list)


class Database:
    """An open database.  Safe to use from any thread; see :meth:`open`."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._damaged = False
        pragmas = (
            "journal_mode = WAL",
            "synchronous = FULL",
            f"journal_size_limit = {_LOG_BYTES}",
            "foreign_keys = ON",
        )
        self._writer = _engine(file, pragmas, "BEGIN IMMEDIATE", connections=1)
        self._readers = _engine(file, ("query_only = ON",), "BEGIN", connections=_READERS)
        self._write = sessionmaker(self._writer)
        self._read = sessionmaker(self._readers)
        self._joined: ContextVar[_Joined | None] = ContextVar("joined", default=None)

    @classmethod
    def open(cls, file: Path, *, may_be_new: bool = True) -> Database:
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
        """A transaction that no other writes beside; an error undoes all of it."""
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

    def is_sound(self) -> bool:
        """Whether it can be read, and no damage was met since it was opened."""
        with suppress(ServiceError), self.reading() as session:
            session.execute(text("SELECT version_num FROM alembic_version")).one()
            return not self._damaged
        return False

    def close(self) -> None:
        self._readers.dispose()
        self._writer.dispose()

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


def migrate(connection: Connection) -> None:
    """Within the connection's transaction: all of it, or nothing.

    Raises :class:`~service.errors.SettingsError` when a newer version has been here.
    """
    try:
        command.upgrade(alembic_config(connection), "head")
    except CommandError as error:
        raise SettingsError(
            f"the database is not of this version ({error}); "
            "start the version that it was last used with, or a newer one"
        ) from error


def alembic_config(connection: Connection) -> Config:
    """The configuration of Alembic's commands on an open connection."""
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS).replace("%", "%%"))
    config.attributes["connection"] = connection
    return config
