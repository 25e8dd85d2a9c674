"""One place for jobs that its caller hands to it, as a task of a cluster does."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable
from pathlib import Path

from service.engines.engine import LIBRARY_WORK
from service.engines.first_start import FirstStart
from service.engines.idleness import Idleness
from service.engines.lease_keeper import LeaseKeeper
from service.engines.signals import Bell, Running
from service.engines.slot import Shop, Slot
from service.engines.trouble import Trouble
from service.jobs.job import Claim
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore, JobStore
from service.settings import Settings

_STARTS = 2  # of a process, before whoever asked is told that none becomes ready here


class SinglePlace:
    """Does one job at a time, in the thread of whoever asks, always the same one.

    Leases, limits, the confined process and what is recorded are those of an
    :class:`~service.engines.engine.Engine`; only the choice of the job is the caller's.
    """

    def __init__(
        self,
        jobs: JobStore,
        blobs: BlobStore,
        board: ProgressBoard,
        settings: Settings,
        scratch: Path,
        work: str = LIBRARY_WORK,
        *,
        threads: int,
    ) -> None:
        self._shop = Shop(
            f"place-{secrets.token_hex(8)}", jobs, blobs, board, settings, scratch, work,
            lambda job: None, Bell(), Running(), Trouble(), FirstStart(lambda: None), Idleness(),
            lambda: threads,
        )  # fmt: skip
        self._slot = Slot(self._shop)
        self._leases = LeaseKeeper(self._shop, shared=True)
        self._keeping = threading.Thread(
            target=self._leases.run, args=(lambda: None, lambda: None), name="occluder leases",
            daemon=True,
        )  # fmt: skip

    def start(self) -> None:
        self._keeping.start()

    def do_one(self, claiming: Callable[[], Claim | None]) -> bool:
        """Claim a job and do it; whether there was one.

        Waits for stores that are away.  Raises
        :class:`~service.engines.process.ProcessDiedError` where no process becomes ready,
        :class:`~service.engines.trouble.StoppedError`, and what ``claiming`` raises else.
        """
        return self._slot.do_one(claiming, _STARTS)

    def stop(self) -> None:
        """Give back the job under way, if any, at no cost to it, and end the process."""
        self._shop.trouble.stop()
        self._shop.running.stop()
        self._leases.close()
        self._slot.end()
        self._keeping.join()
