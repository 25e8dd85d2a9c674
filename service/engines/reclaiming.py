"""Taking back the jobs of servers that have died, and of those that are silent."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass

from service.background import in_background
from service.engines.failures import server_ended
from service.errors import ServiceError
from service.jobs.job import Job
from service.jobs.progress import ProgressBoard
from service.jobs.stores import JobStore

_LOOKS = 3.0  # in the time of a lease

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Reclaimer:
    """Looks at all leases now and then, where this server leads.

    ``on_end``  called with each job whose last attempt was lost.
    """

    jobs: JobStore
    board: ProgressBoard
    lease_seconds: float
    leads: Callable[[], bool]
    on_end: Callable[[Job], None]

    def reclaim(self, *, all_leases: bool) -> None:
        """Do it once.  Raises what the store raises."""
        for job in self.jobs.recover(server_ended(), all_leases=all_leases):
            self.board.announce(job.id)
            if job.state.ended:
                self.on_end(job)

    def running(self) -> AbstractContextManager[None]:
        """Do it in a thread while the block lasts."""
        return in_background(self._rounds, "occluder leases")

    def _rounds(self, stop: threading.Event) -> None:
        failing = False
        while not stop.wait(self.lease_seconds / _LOOKS):
            if not self.leads():
                continue
            try:
                self.reclaim(all_leases=False)
            except Exception as error:
                if not failing:
                    ours = not isinstance(error, ServiceError)
                    _log.error("leases cannot be looked at for now: %s", error, exc_info=ours)
                failing = True
            else:
                failing = False
