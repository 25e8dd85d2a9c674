"""Headers, each as its standard has it: text in, values out.

    Accept           which of some media types to answer in (RFC 9110)
    Idempotency-Key  the same request sent twice is one request
    If-None-Match    answers that spare sending a file (RFC 9110)
    Prefer           wait=N, return=representation: wishes, which are never mistakes (RFC 7240)
    Range, If-Range  parts of a file (RFC 9110)
    Retry-After      a number of seconds, or a date (RFC 9110)

Every file's ETag is strong: the SHA-256 of its bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC
from email.utils import parsedate_to_datetime

from service.errors import FieldError, InvalidOptionsError, RangeNotSatisfiableError

_IDEMPOTENCY_KEY = re.compile("[!-~]{1,255}")
_WAIT = re.compile(r'wait\s*=\s*"?(\d{1,9})"?', re.IGNORECASE)
_REPRESENTATION = re.compile(r'return\s*=\s*"?representation"?', re.IGNORECASE)
_RANGE = re.compile(r"bytes\s*=\s*(\d{0,19})\s*-\s*(\d{0,19})\s*", re.IGNORECASE)


def best_of(accept: str, offered: Sequence[str]) -> str | None:
    """The offered type that is liked best, the first of equals; None where none is accepted.

    No header accepts everything.  A range counts by its most specific mention.
    """
    if not accept.strip():
        return offered[0]
    ranges = [_range(one) for one in accept.split(",") if one.strip()]
    liking = [(_quality(ranges, one), one) for one in offered]
    quality, best = max(liking, key=lambda pair: pair[0])
    return best if quality > 0.0 else None


def _range(text: str) -> tuple[str, float]:
    media_range, *parameters = (part.strip().lower() for part in text.split(";"))
    quality = 1.0
    for parameter in parameters:
        name, _, value = parameter.partition("=")
        if name.strip() == "q":
            quality = _number(value.strip())
    return media_range, quality


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return 0.0
    return value if 0.0 <= value <= 1.0 else 0.0


def _quality(ranges: Sequence[tuple[str, float]], offered: str) -> float:
    kind = offered.partition("/")[0]
    for mention in (offered, f"{kind}/*", "*/*"):
        qualities = [quality for media_range, quality in ranges if media_range == mention]
        if qualities:
            return max(qualities)
    return 0.0


def idempotency_key(headers: Mapping[str, str]) -> str | None:
    """Raises :class:`~service.errors.InvalidOptionsError` for one that is too long or no text."""
    key = headers.get("idempotency-key")
    if key is not None and not _IDEMPOTENCY_KEY.fullmatch(key):
        remedy = "choose 1 to 255 printable ASCII characters without a space, a random UUID say"
        raise InvalidOptionsError([FieldError("Idempotency-Key", "it cannot be kept", remedy)])
    return key


def wait_seconds(headers: Iterable[str], most: float) -> float:
    """How long to wait for a result, at most ``most``; 0 where it is not asked for.

    Of several wishes the first counts; what cannot be understood is passed over.
    """
    for preference in _preferences(headers):
        match = _WAIT.fullmatch(preference)
        if match:
            return min(float(match[1]), most)
    return 0.0


def wants_result(headers: Iterable[str]) -> bool:
    """Whether the result is wanted and nothing else will do (``return=representation``)."""
    return any(map(_REPRESENTATION.fullmatch, _preferences(headers)))


def _preferences(headers: Iterable[str]) -> Iterator[str]:
    """Each wish, without its parameters."""
    for header in headers:
        for preference in header.split(","):
            yield preference.partition(";")[0].strip()


@dataclass(frozen=True)
class ByteRange:
    """Bytes from ``start`` up to but not including ``stop``."""

    start: int
    stop: int


def is_fresh(headers: Mapping[str, str], etag: str) -> bool:
    """Whether the asker has these very bytes already (``If-None-Match``)."""
    return _names(headers.get("if-none-match", ""), etag)


def wanted_range(headers: Mapping[str, str], etag: str, size: int) -> ByteRange | None:
    """The part that ``Range`` asks for; None for the whole file.

    The whole file is also the answer to several ranges at once, to other units, to what is no
    range, and where ``If-Range`` names other bytes: RFC 9110 allows each.  Raises
    :class:`~service.errors.RangeNotSatisfiableError` for a range beyond the end.
    """
    match = _RANGE.fullmatch(headers.get("range", "").strip())
    if match is None or headers.get("if-range", etag).strip() != etag:
        return None
    first, last = match.groups()
    if not first and not last:
        return None
    if first and last and int(first) > int(last):
        return None
    if not first:
        part = ByteRange(max(size - int(last), 0), size)
    else:
        part = ByteRange(int(first), min(int(last) + 1, size) if last else size)
    if part.start >= part.stop:
        raise RangeNotSatisfiableError(size)
    return part


def _names(header: str, etag: str) -> bool:
    tags = [tag.strip().removeprefix("W/") for tag in header.split(",")]
    return "*" in tags or etag in tags


def retry_after(header: str | None, now: float) -> float | None:
    """Seconds from ``now``, Unix seconds, on; None where none are told.  A date may have passed."""
    if header is None:
        return None
    if header.isascii() and header.isdigit():
        return float(header[:9])
    try:
        date = parsedate_to_datetime(header)
    except (ValueError, OverflowError):
        return None
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp() - now
