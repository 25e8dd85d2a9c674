"""Signatures of webhooks, so that a receiver knows whom a word comes from and how old it is.

The signature is the HMAC-SHA256, in hex, of the timestamp, a dot and the body as it was received;
the key is the tenant's secret as text.  The standard library is all that this needs, so that a
receiver can take the file as it is.
"""

from __future__ import annotations

import hashlib
import hmac
import time
from collections.abc import Iterable, Mapping

EVENT_HEADER = "Occluder-Event"
DELIVERY_HEADER = "Occluder-Delivery"
TIMESTAMP_HEADER = "Occluder-Timestamp"
SIGNATURE_HEADER = "Occluder-Signature"
REQUEST_HEADER = "X-Request-Id"  # not signed: for logs

_VERSION = "v1"


class SignatureError(Exception):
    """A webhook is not to be trusted, and why."""


def sign(secret: str, timestamp: int, body: bytes) -> str:
    """The value of the signature's header where one secret is good."""
    signed = f"{timestamp}.".encode() + body
    return f"{_VERSION}={hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()}"


def signatures(secrets: Iterable[str], timestamp: int, body: bytes) -> str:
    """The value of the signature's header where several secrets are good, one by each of them."""
    return ",".join(sign(secret, timestamp, body) for secret in secrets)


def verify(
    secret: str,
    headers: Mapping[str, str],
    body: bytes,
    *,
    tolerance: float = 300.0,
    now: float | None = None,
) -> None:
    """Raise :class:`SignatureError` unless a webhook is signed with a secret, and fresh.

    ``headers`` by their names in any case.  ``body`` as it was received, not parsed and written
    again.  ``tolerance`` is how many seconds the clocks may differ and a word may have been kept
    back; within it the same word can come twice, with the same ``Occluder-Delivery``.
    """
    told = {name.lower(): value for name, value in headers.items()}
    try:
        timestamp = int(told[TIMESTAMP_HEADER.lower()])
        signatures = told[SIGNATURE_HEADER.lower()]
    except (KeyError, ValueError):
        raise SignatureError("the timestamp or the signature is missing") from None
    expected = sign(secret, timestamp, body).encode()
    # Several stand there, with commas between, while a secret is rotated.
    if not any(
        hmac.compare_digest(one.strip().encode(), expected) for one in signatures.split(",")
    ):
        raise SignatureError("the signature is of another body, time or secret")
    if abs((time.time() if now is None else now) - timestamp) > tolerance:
        raise SignatureError("it is too old, or the clocks differ")
