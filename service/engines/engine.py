"""Does the jobs of a job store in warm processes of their own, and never dies itself."""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from service.engines.first_start import FirstStart
from service.engines.idleness import Idleness
from service.engines.lease_keeper import LeaseKeeper
from service.engines.signals import Bell, Running
from service.engines.slot import Shop, Slot
from service.engines.trouble import Trouble
from service.jobs.job import Job
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore, JobStore
from service.settings import Settings, processors

LIBRARY_WORK = "service.engines.work.start:start"
"""What worker processes run: the library's part is imported there and nowhere else."""


class Engine:
    """Does as many jobs at a time as the settings say, each under a lease that is renewed.

    A process that dies costs its job one attempt and nothing else.  Where the stores cannot be
    written, work waits and is tried again.
    """

    def __init__(
        self,
        jobs: JobStore,
        blobs: BlobStore,
        board: ProgressBoard,
        settings: Settings,
        scratch: Path,
        on_end: Callable[[Job], None] = lambda job: None,
        work: str = LIBRARY_WORK,
        *,
        shared: bool = False,
    ) -> None:
        """``scratch`` is on the disk of the blobs.

        ``shared``  whether others may ask for the end of a job without waking this engine.

        ``on_end`` is called with each job that ends, once, in some thread; not if the server is
        killed just then, so what must not be missed belongs into the stores.
        """
        self._shop = Shop(
            f"engine-{secrets.token_hex(8)}", jobs, blobs, board, settings, scratch, work, on_end,
            Bell(), Running(), Trouble(), FirstStart(board.end_preparing),
            Idleness(), self._fair_threads,
        )  # fmt: skip
        self._leases = LeaseKeeper(self._shop, shared=shared)
        self._may_begin = threading.Event()
        self._threads: list[threading.Thread] = []
        self._slots = [Slot(self._shop) for _ in range(settings.workers)]

    @property
    def problem(self) -> str | None:
        """What keeps it from working, in words; None while it works."""
        return self._shop.trouble.in_words

    @property
    def workers(self) -> int:
        """Processes that there are to be."""
        return len(self._slots)

    @property
    def live(self) -> int:
        """Processes that can do a job or do one."""
        return sum(slot.live for slot in self._slots)

    @property
    def busy(self) -> int:
        """Jobs that are done just now."""
        return self._shop.running.count

    @property
    def idle_seconds(self) -> float | None:
        """For how long it has looked for jobs and found none; None while that is not known."""
        return self._shop.idleness.seconds

    def start(self, before: Callable[[], None] = lambda: None) -> None:
        """Begin, once ``before`` is done, which may wait for the stores.  Returns at once."""
        self._shop.board.begin_preparing()
        self._thread("leases", lambda: self._leases.run(before, self._may_begin.set))
        for number, slot in enumerate(self._slots):
            self._thread(f"worker {number}", partial(self._work, slot))

    def wake(self) -> None:
        """A job waits, or is to end: look now rather than later.  From any thread."""
        self._shop.bell.ring()
        self._leases.wake()

    def stop(self) -> None:
        """End all processes and queue their jobs again, at no cost to them."""
        self._shop.trouble.stop()
        self._may_begin.set()
        self._shop.running.stop()
        self._shop.bell.close()
        self._leases.close()
        for thread in self._threads:
            thread.join()

    def _thread(self, name: str, target: Callable[[], None]) -> None:
        thread = threading.Thread(target=target, name=f"occluder {name}", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _work(self, slot: Slot) -> None:
        self._may_begin.wait()
        slot.run()

    def _fair_threads(self) -> int:
        """One a processor where a job is alone, else a fair share of them."""
        if self._shop.running.count == 1:
            return processors()
        return max(1, processors() // self.workers)
