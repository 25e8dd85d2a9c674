"""A time limit: how much of it is spent, and when it is up."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

Clock = Callable[[], float]
"""Seconds since some fixed moment; never goes back."""


@dataclass(frozen=True)
class Deadline:
    """A span of time, from ``begin`` on the clock for ``seconds``; infinite for no limit.

    Looking at one costs a call of the clock, well below a microsecond.
    """

    begin: float
    seconds: float
    clock: Clock = time.perf_counter

    @classmethod
    def after(cls, seconds: float | None, clock: Clock = time.perf_counter) -> Deadline:
        """So many seconds from now; None for no limit."""
        return cls(clock(), math.inf if seconds is None else seconds, clock)

    @property
    def limited(self) -> bool:
        """Whether it ever comes."""
        return self.seconds < math.inf

    @property
    def left(self) -> float:
        """Seconds until it, 0 when they are spent."""
        return max(self.begin + self.seconds - self.clock(), 0.0)

    @property
    def share(self) -> float:
        """The share that is spent, 0 to 1; 0 for good without a limit."""
        if self.seconds <= 0.0:
            return 1.0
        return min((self.clock() - self.begin) / self.seconds, 1.0)

    @property
    def is_up(self) -> bool:
        """Whether it has come."""
        return self.left == 0.0

    def rest(self) -> Deadline:
        """The same moment, its share counted from now."""
        return self.part(1.0)

    def part(self, share: float) -> Deadline:
        """That share of what is left, from now."""
        return Deadline.after(share * self.left, self.clock)
