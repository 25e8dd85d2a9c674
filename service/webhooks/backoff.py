"""How long to wait before a webhook is tried again."""

from __future__ import annotations

import random
from datetime import UTC
from email.utils import parsedate_to_datetime

LONGEST = 3600.0
_FIRST = 10.0
_FACTOR = 3.0
_JITTER = 0.2  # so that what failed together does not come back together


def seconds_until_retry(tried: int, asked: float | None) -> float:
    """After it was ``tried`` so often; what the receiver ``asked`` for counts, up to an hour."""
    if asked is not None:
        return min(max(asked, 1.0), LONGEST)
    spread = random.uniform(1.0 - _JITTER, 1.0 + _JITTER)
    return min(_FIRST * _FACTOR ** (tried - 1) * spread, LONGEST)


def retry_after(header: str | None, now: float) -> float | None:
    """Seconds that a Retry-After header asks for: a number of them, or a date."""
    if header is None:
        return None
    if header.isascii() and header.isdigit():
        return float(header[:9])
    try:
        date = parsedate_to_datetime(header)
    except (ValueError, OverflowError):
        return None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp() - now
