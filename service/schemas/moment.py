"""Times on the wire: ISO 8601, UTC."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Annotated

from pydantic import AwareDatetime, BeforeValidator


def moment(seconds: float) -> datetime:
    """From Unix seconds."""
    return datetime.fromtimestamp(seconds, UTC)


def moment_or_none(seconds: float | None) -> datetime | None:
    return None if seconds is None else moment(seconds)


def _written_out(text: object) -> object:
    if not isinstance(text, str) or not re.match(r"\d{4}-\d\d-\d\dT", text):
        raise ValueError("should be a time such as 2026-01-31T12:00:00Z")
    return text


Moment = Annotated[AwareDatetime, BeforeValidator(_written_out)]
"""A time that a request gives, with its offset from UTC; no count of seconds."""
