"""What keeps an engine from working, and for how long it waits before it tries again."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import TypeVar

from service.errors import DatabaseDamagedError, DiskFullError, NotReadyError

logger = logging.getLogger(__name__)

_FIRST_PAUSE = 0.25  # seconds
_LONGEST_PAUSE = 30.0
_HARMLESS_DEATHS = 3  # of starting processes in a row: a machine short of memory for a moment

T = TypeVar("T")


class StoppedError(Exception):
    """The engine stops, and what was to be done is left."""


class Trouble:
    """Troubles by where they are, each there until it is over.  Safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._troubles: dict[str, str] = {}
        self._stillborn = 0
        self._stopped = threading.Event()

    @property
    def in_words(self) -> str | None:
        """All troubles in words; None while everything works."""
        with self._lock:
            return "; ".join(self._troubles.values()) or None

    @property
    def stopped(self) -> bool:
        return self._stopped.is_set()

    def stop(self) -> None:
        """End all waiting, now and later."""
        self._stopped.set()

    def pause(self, seconds: float) -> None:
        """Raises :class:`StoppedError` as soon as the engine stops."""
        if self._stopped.wait(seconds):
            raise StoppedError

    def insist(
        self, call: Callable[[], T], but: tuple[type[Exception], ...] = (StoppedError,)
    ) -> T:
        """Have the stores do something, again and again while they cannot: no room, a damaged
        page, a lock that another holds, a server that is away.

        Raises :class:`StoppedError`, what is of ``but``, and whatever else the call does.
        """
        tries = 0
        while True:
            try:
                result = call()
            except but:
                raise
            except (DiskFullError, DatabaseDamagedError, NotReadyError) as error:
                if tries == 0:
                    logger.error("%s", error)
                self._tell("stores", str(error))
                self.pause(_pause(tries))
                tries += 1
            else:
                self._end("stores")
                return result

    def born(self) -> None:
        """A process became ready."""
        with self._lock:
            self._stillborn = 0
        self._end("processes")

    def stillborn(self, how: str) -> None:
        """A process died before it was ready; wait before another is tried.

        Raises :class:`StoppedError`.
        """
        with self._lock:
            self._stillborn += 1
            count = self._stillborn
        logger.error("a worker process %s before it was ready (%d in a row)", how, count)
        if count >= _HARMLESS_DEATHS:
            self._tell("processes", f"worker processes die before they are ready: the last {how}")
        self.pause(_pause(count - 1))

    def _tell(self, where: str, what: str) -> None:
        with self._lock:
            self._troubles[where] = what

    def _end(self, where: str) -> None:
        with self._lock:
            self._troubles.pop(where, None)


def _pause(tries: int) -> float:
    return min(_FIRST_PAUSE * 2.0 ** min(tries, 16), _LONGEST_PAUSE)
