"""A bell that wakes one of several waiting threads."""

from __future__ import annotations

import threading


class Bell:
    """Rung once or often before somebody waits, it wakes one waiter, at once."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._rung = self._closed = False

    def ring(self) -> None:
        with self._condition:
            self._rung = True
            self._condition.notify()

    def close(self) -> None:
        """No one waits any more, now or later."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    def wait(self, seconds: float) -> bool:
        """Whether it was rung within that time."""
        with self._condition:
            self._condition.wait_for(lambda: self._rung or self._closed, seconds)
            rung, self._rung = self._rung, False
            return rung
