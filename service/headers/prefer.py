"""``Prefer: wait=N`` as RFC 7240 has it: a wish, which is never a mistake."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

PREFER: dict[str, Any] = {
    "name": "Prefer", "in": "header",
    "description": "`wait=N`: wait up to N seconds for the result.",
    "schema": {"type": "string"}, "example": "wait=30",
}  # fmt: skip
"""As OpenAPI has it."""

_WAIT = re.compile(r'wait\s*=\s*"?(\d{1,9})"?', re.IGNORECASE)


def wait_seconds(headers: Iterable[str], most: float) -> float:
    """How long to wait for a result, at most ``most``; 0 where it is not asked for.

    Of several wishes the first counts; what cannot be understood is passed over.
    """
    for header in headers:
        for preference in header.split(","):
            match = _WAIT.fullmatch(preference.partition(";")[0].strip())
            if match:
                return min(float(match[1]), most)
    return 0.0
