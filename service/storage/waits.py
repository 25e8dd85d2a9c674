"""Jobs that are tried again, but not yet: what went wrong on this machine may take its time.

They are kept in memory, by a clock that is never set: a start forgets them and tries all at once,
as a data folder has one server at a time.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

_FIRST_PAUSE = 0.5  # seconds, doubled from attempt to attempt
_LONGEST_PAUSE = 60.0
_FIRST_PAUSE_FOR_ROOM = 5.0  # nobody frees a disk within seconds
_LONGEST_PAUSE_FOR_ROOM = 300.0


def pause_after_death(attempt: int) -> float:
    """Seconds before a job is begun again whose process was lost in its ``attempt``-th try."""
    return min(_FIRST_PAUSE * 2.0 ** (attempt - 1), _LONGEST_PAUSE)


def pause_for_room(attempt: int) -> float:
    """Seconds before a job is begun again that found the disk full in its ``attempt``-th try."""
    return min(_FIRST_PAUSE_FOR_ROOM * 2.0 ** (attempt - 1), _LONGEST_PAUSE_FOR_ROOM)


class Waits:
    """Numbers of jobs that nobody may claim yet.  Safe to use from any thread.

    ``monotonic``  seconds from a clock that is never set.
    """

    def __init__(self, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self._lock = threading.Lock()
        self._due: dict[int, float] = {}

    def put_off(self, number: int, seconds: float) -> None:
        """A job is not to be claimed for so long."""
        with self._lock:
            self._due[number] = self._monotonic() + seconds

    def numbers(self) -> list[int]:
        """Those of all jobs that still wait."""
        with self._lock:
            now = self._monotonic()
            self._due = {number: due for number, due in self._due.items() if due > now}
            return list(self._due)
