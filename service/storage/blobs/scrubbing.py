"""Reading all blobs anew, now and then, so that damage is found while a backup still has the bytes.

A folder of blobs at a time, the one first whose check is oldest, as slowly as the disk is to be
left to others.  After a restart it goes on where it was.  The way of ZFS's scrub; what is found is
put aside, and sent, made, or repaired from a backup later.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace

from service.background import in_background
from service.errors import ServiceError
from service.jobs.stores import FOLDERS, BlobInventory, BlobState, ScrubFigures
from service.storage.blobs.reading import log_damage
from service.storage.check_store import FolderCheck, SqlCheckStore

_DAY = 86_400.0
_GLANCE = 60.0  # seconds between looks at whether a folder is due, at most
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Findings:
    """What reading a folder of blobs has shown.

    ``checked``  blobs that were read; ``size`` bytes that these had.
    ``damaged``  digests of those whose bytes are others; what was put aside before is not among
                 them.
    ``lost``     digests that rows name and of which nothing is there.
    """

    checked: int = 0
    size: int = 0
    damaged: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()


def read_folder(
    blobs: BlobInventory,
    checks: SqlCheckStore,
    folder: int,
    on_read: Callable[[int], object],
    on_done: Callable[[str, BlobState], object] = lambda digest, state: None,
    *,
    aside: bool,
) -> Findings:
    """Read all blobs of a folder, and look for those that rows name.

    ``on_read``  hears of bytes as :meth:`BlobPlaces.examine` tells them; what it raises ends it.
    ``on_done``  hears of each blob.
    ``aside``    whether to put aside what is damaged.
    """
    checked = size = 0
    damaged: list[str] = []
    gone: set[str] = set()

    def count(read: int) -> None:
        nonlocal size
        size += read
        on_read(read)

    for digest in blobs.digests_in(folder):
        state = blobs.examine(digest, count, aside=aside)
        match state:
            case BlobState.DAMAGED:
                damaged.append(digest)
            case BlobState.GONE:
                gone.add(digest)
        checked += state is not BlobState.GONE
        on_done(digest, state)
    return Findings(checked, size, tuple(damaged), _lost(blobs, checks, folder, gone))


def _lost(
    blobs: BlobInventory, checks: SqlCheckStore, folder: int, gone: set[str]
) -> tuple[str, ...]:
    """What rows name and is not there, nor put aside.

    The rows are looked at before and after: what is swept meanwhile is named by none at the end.
    ``gone``  could not be read for there was nothing, whatever is listed.
    """
    named = checks.named(folder)
    there = {*blobs.digests_in(folder), *blobs.digests_aside()} - gone
    missing = named - there
    return tuple(sorted(missing & checks.named(folder))) if missing else ()


class Stopped(Exception):
    """Reading was ended before its time."""


@dataclass
class Scrubber:
    """Reads all blobs anew within some days.

    ``days``  from one check of a blob to the next; 0 for no checks.
    ``rate``  bytes a second that are read at most.
    ``clock``  the time of day.
    ``leads``  whether it is for this server to read them.
    """

    blobs: BlobInventory
    checks: SqlCheckStore
    days: float
    rate: int
    clock: Callable[[], float] = time.time
    leads: Callable[[], bool] = lambda: True
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _figures: ScrubFigures = field(default_factory=ScrubFigures)
    _lost: dict[int, int] = field(default_factory=dict)

    def figures(self) -> ScrubFigures:
        """What was done since the start, and the age of the oldest check, seconds."""
        watched = self.checks.all()
        age = max(0.0, self.clock() - watched[0].checked) if watched else None
        with self._lock:
            return replace(self._figures, oldest_age=age, lost=sum(self._lost.values()))

    def pause(self) -> float:
        """Seconds until the next folder is to be read: it is its turn, or its check is too old."""
        watched, now, period = self.checks.all(), self.clock(), self.days * _DAY
        overdue = watched[0].checked + period
        turn = watched[-1].checked + period / FOLDERS
        return max(0.0, min(overdue, turn) - now)

    def read_next(self, stop: threading.Event) -> Findings:
        """Read the folder whose check is oldest.  Raises :class:`Stopped` and what stores raise."""

        def slow_down(read: int) -> None:
            if stop.wait(read / self.rate):
                raise Stopped

        watched = self.checks.all()
        # Last in line whatever the clock does: set back, it would have this one read for ever.
        begun = max(self.clock(), math.nextafter(watched[-1].checked, math.inf))
        due = watched[0]
        found = read_folder(self.blobs, self.checks, due.folder, slow_down, aside=True)
        self.checks.note(FolderCheck(due.folder, begun))
        self._tell(due.folder, found)
        return found

    def _tell(self, folder: int, found: Findings) -> None:
        for digest in found.damaged:
            log_damage(digest)
        for digest in found.lost:
            _log.error("the blob %s is gone, and jobs name it; see docs/service.md", digest)
        with self._lock:
            self._lost[folder] = len(found.lost)
            self._figures = replace(
                self._figures,
                checked=self._figures.checked + found.checked,
                size=self._figures.size + found.size,
                damaged=self._figures.damaged + len(found.damaged),
            )

    def running(self) -> AbstractContextManager[None]:
        """Read in a thread while the block lasts."""
        self.checks.begin()
        return in_background(self._rounds, "scrubber") if self.days > 0.0 else nullcontext()

    def _rounds(self, stop: threading.Event) -> None:
        while not stop.is_set():
            try:
                pause = self.pause() if self.leads() else _GLANCE
                if pause == 0.0:
                    self.read_next(stop)
            except Stopped:
                return
            except Exception as error:
                ours = not isinstance(error, ServiceError | OSError)
                _log.error("blobs cannot be checked at the moment: %s", error, exc_info=ours)
                pause = _GLANCE
            stop.wait(min(pause, _GLANCE))
