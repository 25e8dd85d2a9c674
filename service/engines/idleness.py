"""For how long an engine has had nothing to do."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable


class Idleness:
    """Counts from one look that found no job to a later one.  Safe from any thread.

    Between looks nothing is known: an engine whose database does not answer is not idle.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._first: float | None = None
        self._last = 0.0
        self._under_way = 0

    @property
    def seconds(self) -> float | None:
        """None while there is a job, or before there were two looks."""
        with self._lock:
            if self._first is None or self._last <= self._first:
                return None
            return self._last - self._first

    def begin(self) -> None:
        """A job was found."""
        with self._lock:
            self._under_way += 1
            self._first = None

    def end(self) -> None:
        """A job that was found is done, or given back."""
        with self._lock:
            self._under_way -= 1
            self._first = None

    def look(self) -> None:
        """None was found."""
        with self._lock:
            if self._under_way == 0:
                self._last = self._clock()
                if self._first is None:
                    self._first = self._last
