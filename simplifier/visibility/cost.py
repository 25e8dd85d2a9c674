"""What finding sets will cost, told by a few of the cells before the others, and what it cost.

A cell costs its samples times what each takes of boxes and of steps along rays; what these take
depends on the machine, and how many there are on the place.  So some cells are timed that are
spread over the plan.  They are part of the work.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility.scene_look import spread

_FIRST = 1  # cells before the others, for which shared things are made
_MOST, _LEAST = 16, 4  # cells that are timed
_SHARE = 8  # of the cells one is timed


@dataclass(frozen=True)
class Cost:
    """``seconds_a_cell``  in the mean, on all processors together.
    ``seconds``         in all, what the scene is made ready for it included.
    ``cells``           that the mean is of.
    """

    seconds_a_cell: float
    seconds: float
    cells: int


def batches(
    cells: ViewCells, left: NDArray[np.int64], size: int
) -> Iterator[tuple[NDArray[np.int64], bool]]:
    """The cells that are ``left``, some at a time, and whether these are the ones to be timed.

    First one, then a few from all over the plan, then the others as they come, ``size`` together.
    """
    first = spread(cells, left, _FIRST)
    rest = np.setdiff1d(left, first, assume_unique=True)
    most = _MOST if size >= _MOST else _LEAST
    timed = spread(cells, rest, int(np.clip(len(rest) // _SHARE, min(len(rest), _LEAST), most)))
    rest = np.setdiff1d(rest, timed, assume_unique=True)
    if len(first):
        yield first, False
    if len(timed):
        yield timed, True
    for begin in range(0, len(rest), size):
        yield rest[begin : begin + size], False


NO_COST = Cost(0.0, 0.0, 0)


class CostMeter:
    """Clocks a run from here on: ``foretold`` is None until the cells to be timed are done."""

    def __init__(self) -> None:
        self._begun = self._last = time.perf_counter()
        self._cells, self._seconds = 0, 0.0
        self._first = NO_COST
        self.foretold: Cost | None = None

    def ready(self) -> None:
        """The scene is made ready; what follows is cells."""
        self._last = time.perf_counter()

    def tried(self, cells: int, seconds: float) -> None:
        """So many cells were done while the scene was made ready."""
        self._cells, self._seconds = self._cells + cells, self._seconds + seconds

    def add(self, cells: int, left: int, *, timed: bool) -> None:
        """So many cells are done since the last call, or since ``ready``, and so many are left."""
        now = time.perf_counter()
        took, self._last = now - self._last, now
        if self._first.cells == 0:
            self._first = Cost(took / cells, took, cells)
            return
        self._cells, self._seconds = self._cells + cells, self._seconds + took
        if timed:
            each = took / cells
            self.foretold = Cost(each, now - self._begun + each * left, cells)

    @property
    def came(self) -> Cost:
        """Up to the last cell; the first of all is in the mean only where there is no other."""
        if self._cells == 0:
            return Cost(self._first.seconds_a_cell, self._last - self._begun, self._first.cells)
        return Cost(self._seconds / self._cells, self._last - self._begun, self._cells)
