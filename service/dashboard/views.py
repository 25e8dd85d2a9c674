"""What a report says of each direction, and how that spreads over all of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Measure = Literal["recall", "precision"]
Direction = tuple[float, float, float]

_BIN_WIDTHS = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001)
_ENOUGH_BINS = 10  # bins that the values should spread over


@dataclass(frozen=True)
class View:
    """One direction of an accuracy report, by its place there; shares are 0 to 1."""

    index: int
    direction: Direction
    precision: float
    recall: float

    def share(self, measure: Measure) -> float:
        return self.recall if measure == "recall" else self.precision


def views_of(report: Mapping[str, Any]) -> tuple[View, ...]:
    """The views of a report in its order, at least one."""
    return tuple(
        View(index, _direction(row["direction"]), row["precision"], row["recall"])
        for index, row in enumerate(report["by_view"])
    )


def worst_first(views: Sequence[View], measure: Measure) -> list[View]:
    """Views by a measure, lowest first; equals stay in the order of the report."""
    return sorted(views, key=lambda view: view.share(measure))


def _direction(numbers: Sequence[float]) -> Direction:
    x, y, z = numbers
    return x, y, z


@dataclass(frozen=True)
class Bin:
    """Shares of ``low`` to ``high``; ``high`` itself belongs to the last bin only."""

    low: float
    high: float
    count: int


def histogram(shares: Sequence[float]) -> list[Bin]:
    """Bins from the lowest to the highest share, without a gap; shares are 0 to 1, at least one."""
    low, high = min(shares), max(shares)
    width = next(
        (one for one in _BIN_WIDTHS if (high - low) / one >= _ENOUGH_BINS), _BIN_WIDTHS[-1]
    )
    first = math.floor(low / width + 1e-9)
    last = max(first + 1, math.ceil(high / width - 1e-9))
    counts = [0] * (last - first)
    for share in shares:
        counts[min(int(share / width + 1e-9) - first, len(counts) - 1)] += 1
    return [
        Bin(round((first + at) * width, 4), round((first + at + 1) * width, 4), count)
        for at, count in enumerate(counts)
    ]


def quantile(shares: Sequence[float], part: float) -> float:
    """The value that a part of 0 to 1 of all lies at or below, between neighbours by proportion."""
    ordered = sorted(shares)
    place = part * (len(ordered) - 1)
    low = math.floor(place)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (ordered[high] - ordered[low]) * (place - low)
