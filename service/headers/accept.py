"""``Accept`` as RFC 9110 has it: which of some media types to answer in."""

from __future__ import annotations

from collections.abc import Sequence


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
