"""Progress of jobs that other servers do, through the database that all share.

It is written every two seconds at most, of the jobs that run here and have come further, and read
each second, of those that run elsewhere and that somebody here wants to hear of.
"""

from __future__ import annotations

import logging
import threading
from contextlib import AbstractContextManager

from service.background import in_background
from service.errors import ServiceError
from service.jobs.progress import JobProgress, ProgressBoard, ProgressStore

_READ_SECONDS = 1.0
_WRITE_EVERY = 2
"""Rounds of reading."""

_log = logging.getLogger(__name__)


class SharedProgress:
    """Carries progress between a board and the others, in a thread, while a block lasts."""

    def __init__(self, board: ProgressBoard, store: ProgressStore) -> None:
        self._board, self._store = board, store
        self._written: dict[str, JobProgress] = {}
        self._failing = False

    def running(self) -> AbstractContextManager[None]:
        """Do it in a thread while the block lasts."""
        return in_background(self._run, "occluder progress")

    def exchange(self, *, write: bool) -> None:
        """Do it once.  Raises what the store raises."""
        if write:
            told = dict(self._board.told_here())
            news = {one: now for one, now in told.items() if self._written.get(one) != now}
            if news:
                self._store.write(news)
            self._written = told
        wanted = self._board.wanted()
        self._board.hear(wanted, self._store.read(wanted) if wanted else {})

    def _run(self, stop: threading.Event) -> None:
        rounds = 0
        while not stop.wait(_READ_SECONDS):
            rounds += 1
            write = rounds % _WRITE_EVERY == 0
            try:
                self.exchange(write=write)
            except Exception as error:
                if not self._failing:
                    ours = not isinstance(error, ServiceError)
                    _log.warning("progress cannot be shared for now: %s", error, exc_info=ours)
                self._failing = True
            else:
                self._failing &= not write  # to read alone is no sign that all is well
