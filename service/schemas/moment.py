"""Times on the wire: ISO 8601, UTC."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from typing import Annotated

from pydantic import AwareDatetime, BeforeValidator

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def moment(seconds: float) -> datetime:
    """From Unix seconds, cut to microseconds.

    Never later than it was, so that a list from the time that a job shows has that job.
    """
    return _EPOCH + timedelta(microseconds=math.floor(Fraction(seconds) * 1_000_000))


def moment_or_none(seconds: float | None) -> datetime | None:
    return None if seconds is None else moment(seconds)


def _written_out(text: object) -> object:
    if not isinstance(text, str) or not re.match(r"\d{4}-\d\d-\d\dT", text):
        raise ValueError("should be a time such as 2026-01-31T12:00:00Z")
    return text


Moment = Annotated[AwareDatetime, BeforeValidator(_written_out)]
"""A time that a request gives, with its offset from UTC; no count of seconds."""
