"""Telling the jobs of dead servers from those of living ones, whatever the clocks do.

A lease is a number in the job's row that its holder raises ("beat").  Whoever sees the same number
for the length of the lease, by its own monotonic clock, takes the holder for dead.  No time of day
is compared with another, so a clock that jumps neither frees a job that is worked at nor keeps one
that is not.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass


@dataclass(frozen=True)
class Beat:
    """The sign of life of a job's holder: it differs from one renewal and attempt to the next."""

    attempt: int
    beat: int


class LeaseWatch:
    """What this process has seen of leases, and when.  Safe to use from any thread.

    ``monotonic``  seconds from a clock that is never set.
    """

    def __init__(self, monotonic: Callable[[], float]) -> None:
        self._monotonic = monotonic
        self._lock = threading.Lock()
        self._seen: dict[str, tuple[Beat, float]] = {}

    def note(self, job_id: str, beat: Beat) -> None:
        """The holder of a job has given this sign of life; nothing is new if it had already."""
        self.silence(job_id, beat)

    def silence(self, job_id: str, beat: Beat) -> float:
        """Seconds since a job's holder gave this sign of life; 0 when it is seen the first time."""
        with self._lock:
            now = self._monotonic()
            last, since = self._seen.get(job_id, (None, now))
            if last != beat:
                since = now
                self._seen[job_id] = (beat, since)
            return now - since

    def keep_only(self, job_ids: Collection[str]) -> None:
        """Forget all other jobs."""
        with self._lock:
            self._seen = {one: seen for one, seen in self._seen.items() if one in job_ids}
