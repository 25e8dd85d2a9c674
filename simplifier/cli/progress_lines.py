"""Progress where no terminal shows a bar, as in the log of a CI run: a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

EVERY = 5.0
"""Seconds between two lines, and before the first."""


class ProgressLines:
    """Lines on standard error, each with what is done and the seconds since the start."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begin = self._last = clock()

    def tell(self, words: Callable[[], str]) -> None:
        """Print a line if it is time for one; else the words are not asked for."""
        now = self._clock()
        if now - self._last < EVERY:
            return
        self._last = now
        print(f"progress: {words()}, {now - self._begin:.0f} s", file=sys.stderr, flush=True)
