"""Errors over seeds: their mean, their scatter, and the power of a knob that they fall with.

All in points (hundredths of a share), so that half a point is 0.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

HALF_A_POINT = 0.5

Verdict = Literal["yes", "no", "within noise"]


@dataclass(frozen=True)
class Spread:
    """Values of one quantity over ``count`` seeds, two or more.

    ``mean``       theirs.
    ``deviation``  standard deviation of one of them (of the sample: over count - 1).
    """

    mean: float
    deviation: float
    count: int

    @classmethod
    def of(cls, values: ArrayLike) -> Spread:
        """Raises ValueError for fewer than two values, which have no scatter."""
        array = np.asarray(values, dtype=np.float64)
        if array.ndim != 1 or len(array) < 2:
            raise ValueError(f"values have shape {array.shape}: give two or more in a row")
        return cls(float(array.mean()), float(array.std(ddof=1)), len(array))

    @property
    def standard_error(self) -> float:
        """Of the mean."""
        return float(self.deviation / np.sqrt(self.count))

    @property
    def reach(self) -> float:
        """Offset and two deviations: nineteen of twenty single values lie as near to 0."""
        return abs(self.mean) + 2.0 * self.deviation

    @property
    def typical(self) -> float:
        """Root mean square of the values."""
        scatter = self.deviation**2 * (self.count - 1) / self.count
        return float(np.sqrt(self.mean**2 + scatter))


@dataclass(frozen=True)
class Power:
    """The slope of a straight line in logarithms, and its standard error."""

    exponent: float
    error: float


def fitted_power(at: Sequence[float], values: Sequence[float]) -> Power | None:
    """Of ``values`` over ``at`` by least squares; zeros are left out, as they have no logarithm.

    None where fewer than three points are left, which a line would run through whatever they say.
    """
    x, y = (np.asarray(numbers, dtype=np.float64) for numbers in (at, values))
    there = y > 0.0
    if np.count_nonzero(there) < 3:
        return None
    x, y = np.log(x[there]), np.log(y[there])
    slope, height = np.polyfit(x, y, 1)
    rest = y - (slope * x + height)
    freedom, run = len(x) - 2, ((x - x.mean()) ** 2).sum()
    return Power(float(slope), float(np.sqrt((rest**2).sum() / freedom / run)))


def least_good(at: Sequence[int], spreads: Sequence[Spread]) -> int | None:
    """The least value from which on errors stay below half a point; None where none does."""
    found = None
    for value, spread in sorted(zip(at, spreads, strict=True), key=lambda item: -item[0]):
        if spread.reach > HALF_A_POINT:
            break
        found = value
    return found


def below_half_a_point(gain: Spread) -> Verdict:
    """Whether a mean gain is less than half a point either way, two standard errors away."""
    noise = 2.0 * gain.standard_error
    if abs(gain.mean) + noise <= HALF_A_POINT:
        return "yes"
    return "no" if abs(gain.mean) - noise > HALF_A_POINT else "within noise"
