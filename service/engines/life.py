"""Telling a process that works from one that hangs.

The sign of life is processor time.  A message would not do: a thread that beats goes on beating
while the work beside it is deadlocked, and is itself kept from beating by a long call that holds
the interpreter's lock.  A process that takes no processor time at all, with all that it has
started, is stopped, deadlocked, or waits for a disk that does not answer; one that works, however
long it says nothing, takes some.  What works for ever is left to the job's limit on time.
"""

from __future__ import annotations

import time

from service.engines.process import WorkerProcess

_LONGEST_GLANCE = 1.0
"""Seconds that count between two looks: if this process was stopped itself, nobody was silent."""


class LifeWatch:
    """How long a process has been silent, by looks that have to come several times a second."""

    def __init__(self, process: WorkerProcess) -> None:
        self._process = process
        self._taken = process.processor_seconds
        self._looked = time.monotonic()
        self._silent = 0.0

    def silence(self) -> float:
        """Seconds since its last sign of life; 0 where the system does not tell."""
        now, taken = time.monotonic(), self._process.processor_seconds
        passed, self._looked = min(now - self._looked, _LONGEST_GLANCE), now
        alive = taken is None or taken != self._taken
        self._taken = taken
        self._silent = 0.0 if alive else self._silent + passed
        return self._silent
