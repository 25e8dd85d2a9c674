"""Sessions of browsers: a signed cookie that names an API key, and is none.

It cannot be had by guessing, and ends by itself, with its key, and when one signs out.  Nothing of
it is stored but the names of those that were signed out, until they would have ended anyway.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from base64 import urlsafe_b64encode
from collections.abc import Mapping
from dataclasses import dataclass

COOKIE = "occluder_session"
SESSION_SECONDS = 7 * 86_400

_TOKEN = re.compile(r"([0-9a-f]{32})\.([0-9]{1,12})\.([0-9a-f]{32})\.([A-Za-z0-9_-]{43})", re.ASCII)


@dataclass(frozen=True)
class Session:
    """What a cookie says: ``name`` is no other session's; it ends at ``expires``, Unix seconds."""

    key_id: str
    expires: int
    name: str


@dataclass(frozen=True)
class Sessions:
    """Makes and reads the values of the cookie; ``signing_key`` is 32 secret bytes."""

    signing_key: bytes

    def token(self, key_id: str, now: float) -> str:
        """The cookie's value for the key of an id; ``now`` in Unix seconds."""
        told = f"{key_id}.{int(now) + SESSION_SECONDS}.{secrets.token_hex(16)}"
        return f"{told}.{self._signature(told)}"

    def read(self, token: str, now: float) -> Session | None:
        """The session of a token; None where it has run out, or was not made here."""
        match = _TOKEN.fullmatch(token)
        if match is None:
            return None
        key_id, expires, name, signature = match.groups()
        mine = hmac.compare_digest(signature, self._signature(f"{key_id}.{expires}.{name}"))
        return Session(key_id, int(expires), name) if mine and now < int(expires) else None

    def _signature(self, told: str) -> str:
        digest = hmac.new(self.signing_key, f"session {told}".encode(), hashlib.sha256).digest()
        return urlsafe_b64encode(digest).decode().rstrip("=")


def token_in(headers: Mapping[str, str]) -> str | None:
    """What the cookie holds; ``headers`` by their names in lower case."""
    for pair in headers.get("cookie", "").split(";"):
        name, _, value = pair.strip().partition("=")
        if name == COOKIE:
            return value or None
    return None
