"""Parts of a file, and answers that spare sending it, as RFC 9110 has them.

Every file's ETag is strong: the SHA-256 of its bytes.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from service.errors import RangeNotSatisfiableError

_RANGE = re.compile(r"bytes\s*=\s*(\d{0,19})\s*-\s*(\d{0,19})\s*", re.IGNORECASE)


@dataclass(frozen=True)
class Part:
    """Bytes from ``start`` up to but not including ``stop``."""

    start: int
    stop: int


def is_fresh(headers: Mapping[str, str], etag: str) -> bool:
    """Whether the asker has these very bytes already (``If-None-Match``)."""
    return _names(headers.get("if-none-match", ""), etag)


def part_wanted(headers: Mapping[str, str], etag: str, size: int) -> Part | None:
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
        part = Part(max(size - int(last), 0), size)
    else:
        part = Part(int(first), min(int(last) + 1, size) if last else size)
    if part.start >= part.stop:
        raise RangeNotSatisfiableError(size)
    return part


def _names(header: str, etag: str) -> bool:
    tags = [tag.strip().removeprefix("W/") for tag in header.split(",")]
    return "*" in tags or etag in tags
