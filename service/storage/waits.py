"""How long a job is left alone before it is tried again: what went wrong may take its time."""

from __future__ import annotations

_FIRST_PAUSE = 0.5  # seconds, doubled from attempt to attempt
_LONGEST_PAUSE = 60.0
_FIRST_PAUSE_FOR_ROOM = 5.0  # nobody frees a disk within seconds

LONGEST_PAUSE = 300.0
"""Seconds; what is to wait longer was written by a clock that was set back since."""


def pause_after_death(attempt: int) -> float:
    """Seconds before a job is begun again whose process was lost in its ``attempt``-th try."""
    return min(_FIRST_PAUSE * 2.0 ** (attempt - 1), _LONGEST_PAUSE)


def pause_for_room(attempt: int) -> float:
    """Seconds before a job is begun again that found the disk full in its ``attempt``-th try."""
    return min(_FIRST_PAUSE_FOR_ROOM * 2.0 ** (attempt - 1), LONGEST_PAUSE)
