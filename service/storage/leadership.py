"""Which of the servers that share a database does what one alone has to do.

It forgets what is old, sweeps, scrubs, and takes back the jobs of servers that are silent.  Who
leads holds a lock of the database, which ends with its connection: the database ends that as well
where the leader has said nothing for a while, so that one that is stopped keeps nobody waiting.

Two may lead for a moment, one that was cut off and the next.  So what a leader does is right beside
another that does the same, by the locks of its own transactions; leading only spares the work.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from typing import Any

import psycopg

from service.background import in_background
from service.storage.postgres import Place, connect

Leads = Callable[[], bool]
"""Whether this server leads just now."""

SERVERS, DISPATCHERS = 0x0CC1_1EAD, 0x0CC1_D15C
"""Locks of the database: of the servers, and of the dispatchers to Ray."""
_ASK_SECONDS = 2.0
_SILENCE = "15s"
"""After which the database ends the connection of a leader."""

_log = logging.getLogger(__name__)


class Leadership:
    """Tries to lead, in a thread, while a block lasts."""

    def __init__(
        self,
        place: Place,
        ask_seconds: float = _ASK_SECONDS,
        *,
        lock: int = SERVERS,
        duty: str = "it sweeps, and takes back the jobs of others",
    ) -> None:
        """``duty``  what the leader does, for the log."""
        self._place, self._ask_seconds = place, ask_seconds
        self._lock, self._duty = lock, duty
        self._held = threading.Event()

    def held(self) -> bool:
        """Whether this server leads.  From any thread."""
        return self._held.is_set()

    def running(self) -> AbstractContextManager[None]:
        return in_background(self._run, "occluder leader")

    def _run(self, stop: threading.Event) -> None:
        while not stop.is_set():
            with suppress(psycopg.Error), connect(self._place) as connection:
                connection.execute(f"SET idle_session_timeout = '{_SILENCE}'")
                self._try(connection, stop)
            if self._held.is_set():
                _log.info("this one leads no more")
                self._held.clear()
            stop.wait(self._ask_seconds)

    def _try(self, connection: psycopg.Connection[Any], stop: threading.Event) -> None:
        """Ask for the lock until it is given, then keep it until the connection ends.

        Raises psycopg's errors when it does.
        """
        while not stop.is_set():
            if self._held.is_set():
                connection.execute("SELECT 1")
            else:
                row = connection.execute(
                    "SELECT pg_try_advisory_lock(%s)", (self._lock,)
                ).fetchone()
                if row and row[0]:
                    _log.info("this one leads: %s", self._duty)
                    self._held.set()
            stop.wait(self._ask_seconds)
