"""Colours that mean the same on every page and in the pictures that jobs draw, and those of shares.

Shares take cividis (Nunez, Anderton, Renslow, 2018), which reads the same to the colour blind, from
dark for the worst to bright for the best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

BOTH: Colour = (250, 200, 30)
"""What original and occluder cover: hidden rightly."""
MISSED: Colour = (20, 20, 20)
"""What only the original covers: not hidden."""
WRONG: Colour = (30, 90, 220)
"""What only the occluder covers: hidden wrongly."""
NEITHER: Colour = (255, 255, 255)


STOPS: tuple[Colour, ...] = (
    (0, 34, 78), (26, 56, 111), (67, 78, 108), (97, 101, 111), (125, 124, 120),
    (155, 148, 118), (188, 174, 108), (222, 201, 88), (254, 232, 56),
)  # fmt: skip
"""At equal distances, lowest first."""
UNSEEN: Colour = (178, 178, 186)
"""A place that no view sees, beside colours of shares."""


@dataclass(frozen=True)
class Scale:
    """Colours from ``low`` to ``high``, shares of 0 to 1; beyond an end they stay as at the end."""

    low: float
    high: float

    @classmethod
    def over(cls, values: Sequence[float]) -> Scale:
        """The scale that spans some values, of which there is at least one."""
        return cls(min(values), max(values))

    def colour(self, value: float) -> Colour:
        """The colour of a value; the best one where all values are equal."""
        span = self.high - self.low
        share = min(1.0, max(0.0, (value - self.low) / span)) if span > 0.0 else 1.0
        at = share * (len(STOPS) - 1)
        index = min(int(at), len(STOPS) - 2)
        low, high, part = STOPS[index], STOPS[index + 1], at - index
        red, green, blue = (round(a + (b - a) * part) for a, b in zip(low, high, strict=True))
        return red, green, blue


def css(colour: Colour) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
