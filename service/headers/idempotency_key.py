"""``Idempotency-Key``: the same request sent twice is one request."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from service.errors import FieldError, InvalidOptionsError

IDEMPOTENCY_KEY: dict[str, Any] = {
    "name": "Idempotency-Key", "in": "header",
    "description": "The same key with the same request gives the same job again.",
    "schema": {"type": "string", "minLength": 1, "maxLength": 255, "pattern": "^[!-~]+$"},
}  # fmt: skip
"""As OpenAPI has it."""

_KEY = re.compile("[!-~]{1,255}")


def idempotency_key(headers: Mapping[str, str]) -> str | None:
    """Raises :class:`~service.errors.InvalidOptionsError` for one that is too long or no text."""
    key = headers.get("idempotency-key")
    if key is not None and not _KEY.fullmatch(key):
        remedy = "choose 1 to 255 printable ASCII characters without a space, a random UUID say"
        raise InvalidOptionsError([FieldError("Idempotency-Key", "it cannot be kept", remedy)])
    return key
