"""Pictures of the best occluder so far, while it is refined."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Literal

import simplifier
from service.jobs.progress import Snapshot

_SIZE = 160  # pixels a side: some 6 KiB
_PAUSE = 1.0  # seconds before the first and between two
_SHARE = 0.05  # of the time that drawing may take


class BestSoFar:
    """Draws once a second at most, from above; rather later than at a loss of time.

    The first one draws the mesh too, which takes longest; a job that is done within a second draws
    nothing.
    """

    def __init__(
        self,
        mesh: simplifier.TriangleMesh,
        up: Literal["x", "y", "z"],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._mesh, self._up, self._clock = mesh, up, clock
        self._view: simplifier.Viewpoint | None = None
        self._number = 0
        self._due = clock() + _PAUSE

    def __call__(self, progress: simplifier.Progress) -> Snapshot | None:
        """A picture, where one is due."""
        begin = self._clock()
        if progress.best is None or begin < self._due:
            return None
        if self._view is None:
            self._view = simplifier.Viewpoint(self._mesh, size=_SIZE, up=self._up)
        png = self._view.picture(progress.best())
        end = self._clock()
        self._due = end + max(_PAUSE, (end - begin) / _SHARE)
        self._number += 1
        return Snapshot(self._number, png)
