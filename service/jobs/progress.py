"""How far running jobs are: kept in memory, told to whoever listens, lost without harm.

Where several servers share a database, jobs that others do are heard of through it
(:mod:`service.engines.shared_progress`), as long as somebody here wants to know.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from service.jobs.job import Job, JobState

PREPARING = "preparing"
"""The stage of jobs that wait until the first worker process has compiled or loaded all kernels."""

LARGEST_PICTURE = 16 << 10
"""Bytes of a picture that is kept; a worker's are half of that."""

READING = "load"
"""The stage at which a job reads what it was given, before all work on it."""


@dataclass(frozen=True)
class Snapshot:
    """A picture of the best occluder so far: PNG, and its number, which grows within an attempt."""

    number: int
    png: bytes


@dataclass(frozen=True)
class JobProgress:
    """How far a job is.

    ``stage``     of :data:`simplifier.STAGES`, ``occluders`` for a scene, ``runs`` for a trade-off,
                  ``objects`` and ``sets`` for visible sets; :data:`PREPARING` before it is begun.
    ``fraction``  of the whole job, 0 to 1, never falling within an attempt.
    ``measure``   share of the original's occlusion measure that the best so far has; None before.
    ``level``     of detail that is made, from 0; of ``levels``.  Runs, for a trade-off.
    ``picture``   of the best so far; a worker tells each once.
    """

    stage: str
    fraction: float
    measure: float | None = None
    level: int = 0
    levels: int = 1
    seconds: float = 0.0
    picture: Snapshot | None = None


logger = logging.getLogger(__name__)


class ProgressStore(Protocol):
    """Progress that servers tell each other; it may be lost at any time."""

    def write(self, progress: Mapping[str, JobProgress]) -> None:
        """By job id, in the place of what was written before."""

    def read(self, job_ids: Collection[str]) -> Mapping[str, JobProgress]:
        """Of those of these jobs that are done just now."""


_WANTED_SECONDS = 10.0
"""For which somebody who asked once wants to hear more."""

OnChange = Callable[[str], None]
"""Called with a job's id, in any thread, when its progress or its state has changed."""


class ProgressBoard:
    """The latest progress of each running job, with its latest picture.

    Pictures larger than :data:`LARGEST_PICTURE` are dropped.  Safe to use from any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._latest: dict[str, JobProgress] = {}
        self._here: set[str] = set()
        self._asked: dict[str, float] = {}
        self._listeners: dict[str, set[OnChange]] = {}
        self._preparing_since: float | None = None

    def begin_preparing(self) -> None:
        """From now on jobs wait for the first process that can do any."""
        with self._lock:
            self._preparing_since = time.monotonic()

    def end_preparing(self) -> None:
        """There is a process that can do jobs."""
        with self._lock:
            self._preparing_since = None

    @property
    def preparing(self) -> JobProgress | None:
        """What jobs that are queued wait for, and for how long already; None where nothing."""
        with self._lock:
            since = self._preparing_since
        if since is None:
            return None
        return JobProgress(PREPARING, 0.0, seconds=time.monotonic() - since)

    def how_far(self, job: Job) -> JobProgress | None:
        """What there is to tell of a job in its present state; None where nothing is."""
        match job.state:
            case JobState.QUEUED:
                return self.preparing
            case JobState.RUNNING:
                return self.latest(job.id)
            case _:
                return None

    def latest(self, job_id: str) -> JobProgress | None:
        with self._lock:
            if job_id not in self._here:
                self._asked[job_id] = time.monotonic()
            return self._latest.get(job_id)

    def tell(self, job_id: str, progress: JobProgress) -> None:
        """A job that runs here has come further."""
        with self._lock:
            self._here.add(job_id)
            self._latest[job_id] = _with_picture(progress, self._latest.get(job_id))
        self.announce(job_id)

    def end(self, job_id: str) -> None:
        """An attempt is over, or the job is: its progress counts no more."""
        with self._lock:
            self._here.discard(job_id)
            self._asked.pop(job_id, None)
            self._latest.pop(job_id, None)
        self.announce(job_id)

    def told_here(self) -> Mapping[str, JobProgress]:
        """The latest of each job that runs here."""
        with self._lock:
            return {one: self._latest[one] for one in self._here}

    def wanted(self) -> frozenset[str]:
        """Jobs that do not run here and that somebody listens to, or asked after just now."""
        with self._lock:
            since = time.monotonic() - _WANTED_SECONDS
            self._asked = {one: at for one, at in self._asked.items() if at >= since}
            return frozenset({*self._asked, *self._listeners} - self._here)

    def hear(self, wanted: Collection[str], progress: Mapping[str, JobProgress]) -> None:
        """What other servers tell of the jobs that are :meth:`wanted`; the rest run nowhere."""
        with self._lock:
            left = {one for one in wanted if one not in progress and one in self._latest}
            news = {
                one: told
                for one, told in progress.items()
                if one not in self._here and told != self._latest.get(one)
            }
            self._latest.update(news)
            stale = self._latest.keys() - self._here - progress.keys()
            for one in stale:
                del self._latest[one]
        for one in {*news, *left}:
            self.announce(one)

    def announce(self, job_id: str) -> None:
        """Let listeners know that the state of a job is another."""
        with self._lock:
            listeners = list(self._listeners.get(job_id, ()))
        for hear in listeners:
            try:
                hear(job_id)
            except Exception:  # a listener that has gone must not cost the job
                logger.exception("somebody failed to hear of job %s", job_id)

    def listen(self, job_id: str, hear: OnChange) -> Callable[[], None]:
        """Hear of a job from now on, until the returned function is called."""
        with self._lock:
            self._listeners.setdefault(job_id, set()).add(hear)

        def stop() -> None:
            with self._lock:
                listeners = self._listeners.get(job_id, set())
                listeners.discard(hear)
                if not listeners:
                    self._listeners.pop(job_id, None)

        return stop


def _with_picture(progress: JobProgress, before: JobProgress | None) -> JobProgress:
    """Progress with its own picture, or else with the one that was told before."""
    if progress.picture is not None and len(progress.picture.png) <= LARGEST_PICTURE:
        return progress
    return replace(progress, picture=before.picture if before else None)
