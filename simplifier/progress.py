"""What a run tells its caller while it works, and how the caller stops it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

STAGES = (
    "load", "voxelize", "fill", "surface", "sections", "loops", "chains", "cut", "refine",
    "accuracy", "write",
)  # fmt: skip
"""Every stage that a report has a time for, in the order in which they run."""

Listener = Callable[[str, float], None]
"""Called with a stage's name and the share of it that is done, 0 at its start and 1 at its end.

To stop the run, raise from it: :class:`simplifier.errors.CancelledError` or any other exception.
It is called between steps and from the caller's thread only.
"""


class Stopwatch:
    """Times stages and tells a listener about them."""

    def __init__(self, listener: Listener | None = None) -> None:
        self._listener = listener
        self.timings: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block as part of the stage; a stage may run more than once."""
        self.tell(name, 0.0)
        begin = time.perf_counter()
        yield
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - begin
        self.tell(name, 1.0)

    def tell(self, name: str, share: float) -> None:
        """Report progress within a stage."""
        if self._listener is not None:
            self._listener(name, share)
