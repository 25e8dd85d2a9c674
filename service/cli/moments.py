"""Times as people type and read them: how long, or when."""

from __future__ import annotations

import re
from datetime import UTC, datetime

from simplifier import OptionError

_DURATION = re.compile(r"(\d{1,6})(m|h|d|w)", re.ASCII)
_SECONDS = {"m": 60.0, "h": 3_600.0, "d": 86_400.0, "w": 604_800.0}


def read_duration(text: str, option: str) -> float:
    """Seconds of ``30m``, ``24h``, ``90d`` or ``52w``.

    Raises :class:`~simplifier.OptionError` that names the option.
    """
    match = _DURATION.fullmatch(text.strip())
    if match is None:
        raise OptionError(
            f"{text!r} is no time", where=option, remedy="give a number and m, h, d or w, as 24h"
        )
    return int(match[1]) * _SECONDS[match[2]]


def read_moment(text: str, option: str, now: float, *, back: bool = False) -> float:
    """Unix seconds of a time from ``now`` on (or ``back`` from it), or of a date, UTC by default.

    Raises as :func:`read_duration` does.
    """
    if _DURATION.fullmatch(text.strip()):
        seconds = read_duration(text, option)
        return now - seconds if back else now + seconds
    try:
        date = datetime.fromisoformat(text.strip())
        return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise OptionError(
            f"{text!r} is neither a time nor a date",
            where=option,
            remedy="give a number and m, h, d or w, as 90d, or a date, as 2027-01-31",
        ) from None


def moment_words(seconds: float | None) -> str:
    """Unix seconds to the minute, UTC; a dash for none."""
    return "-" if seconds is None else f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M}"
