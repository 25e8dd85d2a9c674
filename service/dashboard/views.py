"""What a report says of each direction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Measure = Literal["recall", "precision"]
Direction = tuple[float, float, float]


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
    """In the order of the report, at least one."""
    return tuple(
        View(index, _direction(row["direction"]), row["precision"], row["recall"])
        for index, row in enumerate(report["by_view"])
    )


def worst_first(views: Sequence[View], measure: Measure) -> list[View]:
    """By the measure, lowest first; equals in the order of the report."""
    return sorted(views, key=lambda view: view.share(measure))


def _direction(numbers: Sequence[float]) -> Direction:
    x, y, z = numbers
    return x, y, z
