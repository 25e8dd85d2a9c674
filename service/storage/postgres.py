"""PostgreSQL, shared by several servers and workers.

A transaction that writes is READ COMMITTED and locks the rows that it changes; one that reads sees
one state of things (REPEATABLE READ, read only).  Every commit is on the disk before it is told.

Time is the database server's: each process reads its clock once a minute and counts on by its own
monotonic one, so that all agree on what is due without asking each time.

Whoever waits listens (:class:`Listener`); whoever is to do what one alone may do holds a lock that
ends with its connection (:mod:`service.storage.leadership`).  Neither outlives a transaction behind
a pooler that gives each transaction another connection, so such a one is refused when opened.
"""

from __future__ import annotations

import hashlib
import logging
import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import psycopg
from sqlalchemy import URL, Engine, create_engine, func, make_url, select, text
from sqlalchemy.exc import ArgumentError, DBAPIError
from sqlalchemy.exc import TimeoutError as PoolTimeoutError
from sqlalchemy.orm import Session

from service.background import in_background
from service.errors import DatabaseDamagedError, DiskFullError, NotReadyError, SettingsError
from service.storage.database import Database, Topic, UndoneError
from service.storage.schema import check_schema, deployed, migrate, newest_schema
from simplifier import __version__

OLDEST = 14
"""The oldest major version of PostgreSQL that this was tried with."""

_WRITERS, _READERS = 8, 12
"""Connections of a process, at most, which are made as they are needed."""

_CONNECT_SECONDS = 5
_WAIT_SECONDS = 30
_MIGRATION_LOCK = 0x0CC1_0DE2  # of this program's, by chance alone another's

_SESSION = (
    "SET statement_timeout = '60s'; SET lock_timeout = '30s'; "
    "SET idle_in_transaction_session_timeout = '60s'; SET synchronous_commit = on"
)

# https://www.postgresql.org/docs/current/errcodes-appendix.html
_UNDONE = ("40001", "40P01", "55P03", "23503", "23505")
"""Serialization, deadlock, a lock that is not free; and a row that another removed or made since
it was looked for."""
_DAMAGE = ("XX001", "XX002")
_NO_ROOM = ("53100",)
_PASSING = ("08", "25006", "53", "55", "57", "58")
"""Beginnings: lost connections, a standby, too few resources, an operator's doing, the system."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Place:
    """Where a database is; its password is in no message."""

    url: URL

    @classmethod
    def of(cls, address: str) -> Place:
        """``postgresql://USER:PASSWORD@HOST:PORT/NAME``.  Raises
        :class:`~service.errors.SettingsError`."""
        try:
            url = make_url(address)
        except (ArgumentError, ValueError):
            url = None
        if url is None or url.get_backend_name() not in ("postgresql", "postgres"):
            raise SettingsError(
                "OCCLUDER_DATABASE_URL is no address of PostgreSQL; "
                "write it as postgresql://USER:PASSWORD@HOST:PORT/NAME"
            )
        return cls(url.set(drivername="postgresql+psycopg"))

    def __str__(self) -> str:
        return self.url.render_as_string(hide_password=True).replace("+psycopg", "")

    @property
    def words(self) -> str:
        """For psycopg itself."""
        return self.url.set(drivername="postgresql").render_as_string(hide_password=False)


class PostgresDatabase(Database):
    """An open database; see :meth:`open`."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._damaged = False
        self._server_clock = _ServerClock(self._ask_time)
        super().__init__(
            writer=_engine(place, _WRITERS, isolation_level="READ COMMITTED"),
            reader=_engine(
                place, _READERS, isolation_level="REPEATABLE READ", postgresql_readonly=True
            ),
        )

    @classmethod
    def open(cls, address: str) -> PostgresDatabase:
        """Check that it may be used as it is.

        Raises :class:`~service.errors.SettingsError`, within seconds, where it cannot be reached,
        has no tables of this release, or the wrong ones, or lies behind a pooler that gives each
        transaction another connection.
        """
        place = Place.of(address)
        check_server(place)
        database = cls(place)
        try:
            with database._raising_service_errors(), database._reader.connect() as connection:
                check_schema(deployed(connection))
        except (NotReadyError, DBAPIError) as error:
            database.close()
            told = str(error) if isinstance(error, NotReadyError) else _first_line(error.orig)
            raise SettingsError(
                f"the database '{place}' cannot be used ({told}); "
                "let its user read and write the tables that 'occluder migrate' makes"
            ) from None
        except BaseException:
            database.close()
            raise
        return database

    @property
    def place(self) -> Place:
        return self._place

    @property
    def damaged(self) -> bool:
        return self._damaged

    def clock(self) -> float:
        return self._server_clock.now()

    def shared_clock(self) -> float:
        return self._server_clock.now()

    @property
    def shared(self) -> bool:
        return True

    def do_without_flush(self, session: Session) -> None:
        session.execute(text("SET LOCAL synchronous_commit = off"))

    def lock(self, session: Session, name: str) -> bool:
        digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
        number = int.from_bytes(digest, "big", signed=True)
        return bool(session.scalar(select(func.pg_try_advisory_xact_lock(number))))

    def tell(self, session: Session, topic: Topic, what: str = "") -> None:
        session.execute(select(func.pg_notify(_channel(topic), what)))

    def _ask_time(self) -> float:
        with self._raising_service_errors(), self._reader.connect() as connection:
            query = select(func.extract("epoch", func.clock_timestamp()))
            return float(connection.execute(query).scalar_one())

    @contextmanager
    def _raising_service_errors(self) -> Iterator[None]:
        try:
            yield
        except PoolTimeoutError:
            raise NotReadyError(
                "the database is busier than it can bear", remedy="try again in a minute"
            ) from None
        except DBAPIError as error:
            self._translate(error)
            raise

    def _translate(self, error: DBAPIError) -> None:
        """Raise what it means for the service; return where it is a fault of ours."""
        state = getattr(error.orig, "sqlstate", None)
        words = _first_line(error.orig)
        if state in _UNDONE:
            raise UndoneError(f"others were at the same rows: {words}") from error
        if state in _DAMAGE:
            self._damaged = True
            raise DatabaseDamagedError(
                f"the database '{self._place}' is damaged ({words})",
                remedy="stop the service and put back a backup",
            ) from error
        if state in _NO_ROOM:
            raise DiskFullError(
                "there is no room for the database",
                remedy="make room on the disk of PostgreSQL; nothing was lost",
            ) from error
        passing = state is not None and state.startswith(_PASSING)
        if passing or (state is None and isinstance(error.orig, psycopg.OperationalError)):
            raise NotReadyError(
                f"the database cannot be used at the moment ({words})",
                remedy="try again in a minute",
            ) from error


def migrate_server(address: str, release: str = __version__) -> str:
    """Bring a database to the schema of this release, one at a time; where it was, in words.

    Raises :class:`~service.errors.SettingsError`.
    """
    place = Place.of(address)
    check_server(place)
    engine = _engine(place, 1, isolation_level="READ COMMITTED")
    try:
        with engine.begin() as connection:
            for limit in ("statement_timeout", "lock_timeout"):
                connection.exec_driver_sql(f"SET LOCAL {limit} = 0")
            connection.execute(select(func.pg_advisory_xact_lock(_MIGRATION_LOCK)))
            before = deployed(connection)
            if before.schema is not None:
                _check_newer(before.schema, release)
            migrate(connection, release)
            after = deployed(connection)
    except DBAPIError as error:
        raise SettingsError(
            f"the database '{place}' cannot be migrated ({_first_line(error.orig)}); "
            "let its user make tables in it: GRANT CREATE, USAGE ON SCHEMA public"
        ) from error
    finally:
        engine.dispose()
    if before.schema == after.schema:
        return f"the database has schema {after.schema} already"
    came = "was empty" if before.schema is None else f"had schema {before.schema}"
    return f"the database {came}, and has schema {after.schema} now"


def _check_newer(found: str, release: str) -> None:
    if found > newest_schema():
        raise SettingsError(
            f"the database has schema {found}, and release {release} knows none beyond "
            f"{newest_schema()}; run 'occluder migrate' of the newest release"
        )


def check_server(place: Place) -> None:
    """Raises :class:`~service.errors.SettingsError` where the server cannot be what is needed."""
    try:
        with connect(place) as connection:
            version = connection.info.server_version // 10_000
            row = connection.execute("SELECT pg_encoding_to_char(encoding) FROM pg_database "
                                     "WHERE datname = current_database()").fetchone()  # fmt: skip
            pooled = _is_pooled(place, connection)
    except psycopg.OperationalError as error:
        raise SettingsError(_refusal(place, error)) from None
    except psycopg.Error as error:
        raise SettingsError(
            f"the database '{place}' cannot be used ({_first_line(error)}); "
            "check OCCLUDER_DATABASE_URL and the rights of its user"
        ) from None
    if version < OLDEST:
        raise SettingsError(
            f"the database '{place}' is PostgreSQL {version}; use {OLDEST} or newer"
        )
    encoding = row[0] if row else "unknown"
    if encoding != "UTF8":
        raise SettingsError(
            f"the database '{place}' keeps text as {encoding}; "
            "make it anew with ENCODING 'UTF8' TEMPLATE template0"
        )
    if pooled:
        raise SettingsError(
            f"the database '{place}' is behind a pooler in transaction mode, through which servers "
            "cannot listen; give its address past the pooler, or set pool_mode = session"
        )


def _is_pooled(place: Place, first: psycopg.Connection[Any]) -> bool:
    """Whether what was set for one connection is lost to it, or is found by another.

    While others are busy with the server's connections, a pooler in transaction mode gives the
    first one another of them.
    """
    mark = secrets.token_hex(8)
    setting = "SELECT current_setting('occluder.mark', true)"
    first.execute(f"SET occluder.mark = '{mark}'")
    with connect(place) as second:
        second.autocommit = False
        found = second.execute(setting).fetchone()
        kept = first.execute(setting).fetchone()
        second.rollback()
    return found == (mark,) or kept != (mark,)


def _refusal(place: Place, error: psycopg.OperationalError) -> str:
    words = _first_line(error)
    state = error.sqlstate or _state_in(words)
    remedies = {
        "3D000": "make it: CREATE DATABASE … ENCODING 'UTF8'",
        "28P01": "check the user and the password in OCCLUDER_DATABASE_URL",
        "28000": "check the user in OCCLUDER_DATABASE_URL, and pg_hba.conf of the server",
        "42501": "let its user connect: GRANT CONNECT ON DATABASE",
        "53300": "raise max_connections of the server, or run fewer servers and workers",
    }
    remedy = remedies.get(state, "check that PostgreSQL runs there and OCCLUDER_DATABASE_URL")
    return f"the database '{place}' cannot be opened ({words}); {remedy}"


def _state_in(words: str) -> str:
    """libpq tells no code of what fails before there is a connection."""
    told = (
        ("does not exist", "3D000" if "database" in words else "28000"),
        ("password authentication failed", "28P01"),
        ("no pg_hba.conf entry", "28000"),
        ("permission denied", "42501"),
        ("too many", "53300"),
        ("remaining connection slots", "53300"),
    )
    return next((state for part, state in told if part in words), "")


def _first_line(error: BaseException | None) -> str:
    """What libpq and the server say, without what they say before it."""
    first = next(iter(str(error).strip().splitlines()), "no reason was given")
    return first.rpartition("FATAL:")[2].removeprefix("connection failed:").strip()


def connect(place: Place) -> psycopg.Connection[Any]:
    """A connection that commits each statement.  Raises psycopg's errors."""
    return psycopg.connect(
        place.words, autocommit=True, connect_timeout=_CONNECT_SECONDS,
        application_name="occluder", keepalives_idle=10, keepalives_interval=5,
        keepalives_count=3, tcp_user_timeout=20_000,
    )  # fmt: skip


def _engine(place: Place, connections: int, **options: Any) -> Engine:
    return create_engine(
        place.url,
        creator=lambda: _set_up(connect(place)),
        pool_size=connections,
        max_overflow=0,
        pool_timeout=_WAIT_SECONDS,
        pool_pre_ping=True,
        execution_options=options,
    )


def _set_up(connection: psycopg.Connection[Any]) -> psycopg.Connection[Any]:
    connection.execute(_SESSION)
    connection.autocommit = False
    return connection


def _channel(topic: Topic) -> str:
    return f"occluder_{topic}"


class _ServerClock:
    """The time of the database server, read once a minute.  Safe from any thread."""

    def __init__(self, ask: Callable[[], float]) -> None:
        self._ask = ask
        self._lock = threading.Lock()
        self._ahead: float | None = None  # of the monotonic clock of this process
        self._read = 0.0

    def now(self) -> float:
        """Raises what asking raises, unless it was read before."""
        with self._lock:
            begun = time.monotonic()
            if self._ahead is None or begun - self._read > 60.0:
                try:
                    told = self._ask()
                except NotReadyError:
                    if self._ahead is None:
                        raise
                else:
                    self._ahead = told - (begun + time.monotonic()) / 2.0
                self._read = time.monotonic()
            return time.monotonic() + self._ahead


class Listener:
    """Hears what other servers tell, in a thread of its own, and connects again when cut off.

    What is told while it is cut off is lost: ``on_again`` is called when it hears anew, and
    whoever waits looks now and then all the same.
    """

    def __init__(
        self,
        place: Place,
        heard: Callable[[Topic, str], None],
        on_again: Callable[[], None] = lambda: None,
    ) -> None:
        self._place, self._heard, self._on_again = place, heard, on_again

    def running(self) -> AbstractContextManager[None]:
        return in_background(self._run, "occluder listener")

    def _run(self, stop: threading.Event) -> None:
        pause = 0.25
        while not stop.is_set():
            try:
                with connect(self._place) as connection:
                    for topic in Topic:
                        connection.execute(f"LISTEN {_channel(topic)}")
                    pause = 0.25
                    self._call(self._on_again)
                    self._hear(connection, stop)
            except psycopg.Error as error:
                logger.warning("news of other servers cannot be heard: %s", _first_line(error))
            stop.wait(pause)
            pause = min(2.0 * pause, 10.0)

    def _hear(self, connection: psycopg.Connection[Any], stop: threading.Event) -> None:
        topics = {_channel(topic): topic for topic in Topic}
        while not stop.is_set():
            for told in connection.notifies(timeout=0.5):
                self._call(partial(self._heard, topics[told.channel], told.payload))
                if stop.is_set():
                    return

    def _call(self, do: Callable[[], None]) -> None:
        try:
            do()
        except Exception:
            logger.exception("news of another server could not be passed on")
