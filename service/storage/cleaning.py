"""Forgetting what is old, and freeing what nothing names any more."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

from service.background import in_background
from service.errors import ServiceError
from service.idempotency import KEPT_SECONDS, Answers
from service.jobs.asset import AssetStore
from service.jobs.stores import BlobStore, JobStore
from service.journal import Journal

_DAY = 86_400.0
_GLANCE = 5.0  # seconds between looks at whether this server leads by now
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Cleaned:
    """What one round freed: jobs and entries of the journal that were forgotten, assets that were
    removed a while ago, and blobs."""

    jobs: int
    blobs: int
    entries: int = 0
    assets: int = 0


@dataclass(frozen=True)
class Cleaner:
    """Removes what is old.

    ``keep_days``     that ended jobs are kept, 0 for ever.
    ``journal_days``  that entries of the journal are, likewise.
    ``seconds``       between two rounds.
    ``leads``         whether it is for this server to clean.
    """

    jobs: JobStore
    assets: AssetStore
    blobs: BlobStore
    journal: Journal
    answers: Answers
    keep_days: float
    journal_days: float
    seconds: float
    leads: Callable[[], bool] = lambda: True

    def clean(self, now: float) -> Cleaned:
        """Do one round; ``now`` in Unix seconds.  Raises what the stores raise."""
        forgotten = self.jobs.expire(now - self.keep_days * _DAY) if self.keep_days else 0
        entries = self.journal.expire(now - self.journal_days * _DAY) if self.journal_days else 0
        self.answers.expire(now - KEPT_SECONDS)
        removed = self.assets.remove_due(now)
        return Cleaned(forgotten, self.blobs.sweep(self.jobs.unnamed), entries, removed)

    def running(self) -> AbstractContextManager[None]:
        """Do rounds in a thread, the first at once: what a killed server left goes then."""
        return in_background(self._rounds, "cleaner")

    def _rounds(self, stop: threading.Event) -> None:
        # A clock that jumps ahead must not make every job old; one that jumps back keeps them.
        ahead = time.time() - time.monotonic()
        while True:
            if not self.leads():
                if stop.wait(min(_GLANCE, self.seconds)):
                    return
                continue
            try:
                cleaned = self.clean(min(time.time(), ahead + time.monotonic()))
            except Exception as error:
                # What the stores tell of, a full disk or damage, is no fault of the program.
                ours = not isinstance(error, ServiceError)
                _log.error(
                    "cleaning failed, and is tried again in %.0f s: %s",
                    self.seconds, error, exc_info=ours,
                )  # fmt: skip
            else:
                _log.info(
                    "cleaning freed %d jobs, %d assets, %d blobs and %d entries of the journal",
                    cleaned.jobs, cleaned.assets, cleaned.blobs, cleaned.entries,
                )  # fmt: skip
            if stop.wait(self.seconds):
                return
