"""Figures as the terminal and the reports word them, and a dash for what is not known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime

from service.dashboard.views import Direction
from simplifier import wording

_UNKNOWN = "-"

VERDICT_CLASSES = {"good": "good", "weak": "doubt", "unusable": "bad"}
"""How a verdict looks, by its word."""


def percent(share: float | None, digits: int = 2) -> str:
    """A share of 0 to 1, never more than it is: 98.99 % does not reach 99, nor 99.99 all.

    ``digits``  fewer only of what changes while one looks; all else has the same everywhere.
    """
    return _UNKNOWN if share is None else wording.percent(share, digits)


def exact_percent(share: float) -> str:
    """A bar as it was typed."""
    return wording.exact_percent(share)


def overhang(share: float | None) -> str:
    """What is to be small: never less than it is."""
    return _UNKNOWN if share is None else wording.percent_at_most(share)


def length(value: float | None) -> str:
    """In the mesh's units."""
    return _UNKNOWN if value is None or not math.isfinite(value) else wording.length(value)


def lengths_alike(values: Sequence[float]) -> list[str]:
    """Lengths of one column: all with the decimals that :func:`length` gives the largest."""
    largest = length(max(map(abs, values), default=0.0))
    if "e" in largest:
        return [length(value) for value in values]
    decimals = len(largest.partition(".")[2])
    # Adding nothing makes -0.0, which would read "-0.0", a plain zero.
    return [f"{round(value, decimals) + 0.0:,.{decimals}f}" for value in values]


def distance_range(level: int, starts: Sequence[float | None]) -> str:
    """From where to where a level of detail is used, in the mesh's units."""
    return wording.distance_range(level, _promised(starts))


def distance_advice(level: int, starts: Sequence[float | None]) -> str:
    """The same as advice: ``"use from 0 to 4,037 units; beyond, level 1"``."""
    return wording.distance_advice(level, _promised(starts))


def _promised(starts: Sequence[float | None]) -> list[float | None]:
    return [one if one is not None and math.isfinite(one) else None for one in starts]


def whole(value: int | None) -> str:
    """A number of things."""
    return _UNKNOWN if value is None else f"{value:,}"


def seconds(value: float | None) -> str:
    """A span of time."""
    return _UNKNOWN if value is None else wording.seconds(value)


def side_by_side(value: float | None) -> str:
    """A span of time among others to compare it with."""
    return _UNKNOWN if value is None else wording.short_seconds(value)


def points(shares: float) -> str:
    """A difference of two shares."""
    return f"{100.0 * shares:.2f} points"


def viewpoint(direction: Direction, up: str) -> str:
    """Where one stands who looks along a line of sight."""
    return wording.viewpoint(direction, up)


def moment(unix: float) -> str:
    """A time of day, UTC."""
    return f"{datetime.fromtimestamp(unix, UTC):%Y-%m-%d %H:%M:%S} UTC"
