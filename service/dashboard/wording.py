"""Numbers as people read them."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from service.dashboard.views import Direction

_UNKNOWN = "-"
_ROUNDING = 1e-9  # 0.29 times 100 is 28.999999999999996


def percent(share: float | None, digits: int = 1) -> str:
    """A share of 0 to 1, never more than it is: 98.99 % does not reach 99, nor 99.99 all."""
    if share is None:
        return _UNKNOWN
    step = 10.0**-digits
    steps = math.floor(100.0 * share / step + _ROUNDING)
    if steps == 0 and share > 0.0:
        return f"< {step:.{digits}f} %"
    return f"{steps * step:.{digits}f} %"


def length(value: float | None) -> str:
    """In the mesh's units, three digits or more."""
    if value is None or not math.isfinite(value):
        return _UNKNOWN
    return f"{value:,.0f}" if 1000.0 <= abs(value) < 1e9 else f"{value:.3g}"


def whole(value: int | None) -> str:
    return _UNKNOWN if value is None else f"{value:,}"


def seconds(value: float | None) -> str:
    if value is None:
        return _UNKNOWN
    if value < 1.0:
        return f"{1000.0 * value:.0f} ms"
    return f"{value:.1f} s" if value < 100.0 else f"{value:,.0f} s"


def points(shares: float) -> str:
    """A difference of two shares."""
    return f"{100.0 * shares:.2f} points"


def along(direction: Direction) -> str:
    """A line of sight by its components."""
    return "({})".format(", ".join(f"{round(x, 2) + 0.0:.2f}" for x in direction))


def moment(unix: float) -> str:
    """A time of day, UTC."""
    return f"{datetime.fromtimestamp(unix, UTC):%Y-%m-%d %H:%M:%S} UTC"
