"""How long to wait before a webhook is tried again."""

from __future__ import annotations

import random

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
