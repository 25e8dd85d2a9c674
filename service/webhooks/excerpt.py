"""What may be shown of a receiver's answer: a little text, and no address of the network inside.

An answer is what the service can reach and its users perhaps cannot.  So only that of a public
address is shown, and what it says of private ones, as a proxy in between does, is taken out.
"""

from __future__ import annotations

import re
from ipaddress import ip_address

import httpx

from service.webhooks.address_guard import fault_of

MAY_BE_SHOWN = "occluder_public"
"""Extension of a response that came from a public address."""

_LONGEST = 500  # characters
_HIDDEN = "[internal]"

_TEXT = re.compile(r"text/|application/(?:[\w.-]+\+)?(?:json|xml)\b", re.IGNORECASE)
_V4 = re.compile(r"(?<![\w.])\d{1,3}(?:\.\d{1,3}){3}(?![\w.]*\d)")
_V6 = re.compile(r"(?<![\w:])[0-9A-Fa-f]{0,4}(?::[0-9A-Fa-f.]{0,15}){2,7}(?![\w:])")
_NAME = re.compile(
    r"\b(?:[\w-]+\.)+(?:internal|intranet|local|localdomain|localhost|lan|svc|corp|home\.arpa)\b"
    r"|\blocalhost\b",
    re.IGNORECASE,
)


def excerpt_of(response: httpx.Response, beginning: bytes) -> str | None:
    """The beginning of an answer in one line; None where none may be shown or it is no text."""
    headers = response.headers
    if not response.extensions.get(MAY_BE_SHOWN) or headers.get("content-encoding"):
        return None
    if not _TEXT.match(headers.get("content-type", "")):
        return None
    # Addresses before the cut: one that is cut in two would pass for another.
    text = without_addresses(beginning.decode("utf-8", "replace"))
    text = "".join(one if one.isprintable() else " " for one in text)
    return " ".join(text.split())[:_LONGEST] or None


def without_addresses(text: str) -> str:
    """Text without addresses that are not public, and names that are of no public network."""
    text = _V6.sub(_hidden, text)
    text = _V4.sub(_hidden, text)
    return _NAME.sub(_HIDDEN, text)


def _hidden(match: re.Match[str]) -> str:
    try:
        address = ip_address(match[0])
    except ValueError:
        return match[0]  # a time of day, a version
    return match[0] if fault_of(address, allow_private=False) is None else _HIDDEN
