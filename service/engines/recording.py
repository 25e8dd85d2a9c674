"""What came of an attempt, written to the stores."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from service.engines.attempt import AttemptOutcome, GivenUp, Hindered, NotDone, Succeeded
from service.engines.failures import disk_full
from service.engines.signals import Orders
from service.engines.trouble import Trouble
from service.errors import DiskFullError, HoldLostError
from service.jobs.job import Claim, JobFile
from service.jobs.media_types import media_type_of
from service.jobs.stores import BlobStore, JobStore, Keeping

_WRITERS = 8
_ROOM_SECONDS = 60.0  # that a result waits for room on the disk
_ROOM_GLANCE = 1.0


@dataclass(frozen=True)
class Recorder:
    """Writes outcomes; insists where the stores have no room, so that nothing is done twice."""

    jobs: JobStore
    blobs: BlobStore
    trouble: Trouble

    def record(self, claim: Claim, outcome: AttemptOutcome, results: Path, orders: Orders) -> bool:
        """End the attempt; whether its lease still held, so that this is what counts.

        The folder that ``results`` is in belongs to the attempt alone, and may be gone afterwards.
        Raises :class:`~service.engines.trouble.StoppedError` when the engine stops before that.
        """
        if orders.dropped:
            return False
        if orders.cancelled:
            return self._record_end(claim)
        match outcome:
            case Succeeded():
                return self._record_success(claim, outcome, results, orders)
            case NotDone():
                return self._record_failure(claim, outcome)
            case Hindered():
                return self._record_hindrance(claim, outcome, results)
            case GivenUp():
                return self.trouble.insist(lambda: self.jobs.release(claim))

    def _record_success(
        self, claim: Claim, outcome: Succeeded, results: Path, orders: Orders
    ) -> bool:
        try:
            with self.blobs.keeping() as keeping:
                files = self.store_files(keeping, results)
                if orders.cancelled:
                    return self._record_end(claim)
                return self.trouble.insist(lambda: self.jobs.succeed(claim, files, outcome.summary))
        except DiskFullError:
            return self._record_hindrance(claim, Hindered(disk_full("the result")), results)
        except HoldLostError:
            # This process was held up for so long that others have removed its files.
            return self.trouble.insist(lambda: self.jobs.release(claim))

    def _record_end(self, claim: Claim) -> bool:
        return self.trouble.insist(lambda: self.jobs.end_cancelled(claim))

    def _record_failure(self, claim: Claim, outcome: NotDone) -> bool:
        state = self.trouble.insist(
            lambda: self.jobs.fail(claim, outcome.failure, final=outcome.final)
        )
        return state is not None

    def _record_hindrance(self, claim: Claim, outcome: Hindered, results: Path) -> bool:
        # What was made so far may take the very room that the row needs.
        shutil.rmtree(results.parent, ignore_errors=True)
        state = self.trouble.insist(lambda: self.jobs.put_off(claim, outcome.failure))
        return state is not None

    def store_files(self, keeping: Keeping, results: Path) -> list[JobFile]:
        """Store all files of a folder side by side: most of the time goes to waiting for the disk.

        Raises :class:`DiskFullError` when there was no room for a minute.
        """
        until = time.monotonic() + _ROOM_SECONDS

        def keep(path: Path) -> JobFile:
            name = path.relative_to(results).as_posix()
            while True:
                try:
                    blob = self.trouble.insist(lambda: keeping.put_file(path), but=(DiskFullError,))
                    return JobFile(name, blob, media_type_of(name))
                except DiskFullError:
                    if time.monotonic() >= until:
                        raise
                    self.trouble.pause(_ROOM_GLANCE)

        with ThreadPoolExecutor(_WRITERS, "occluder results") as pool:
            return list(pool.map(keep, _files(results)))


def _files(folder: Path) -> Iterator[Path]:
    """All plain files below a folder, by name; links are none."""
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not path.is_symlink():
            yield path
