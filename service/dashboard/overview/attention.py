"""What needs attention first: uploads that failed, assets below their thresholds, and falls.

Each asset is named once, for its most urgent reason.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from urllib.parse import urlencode

from service.dashboard.jobs.words import failure_title, sentence
from service.dashboard.overview.asset_lines import Change, Overview
from service.dashboard.wording import exact_percent, overhang, percent, points
from service.jobs.asset import RunNumbers, Thresholds


class Reason(StrEnum):
    """Why something needs attention, most urgent first; the value narrows the list of assets."""

    FAILED = "failed"
    MISSED = "missed"
    WORSE = "worse"


@dataclass(frozen=True)
class Matter:
    """Something that needs attention.

    ``name``   of the asset, or of a file that is none; ``address`` where to look at it.
    ``words``  what the matter is, in sentences.
    ``size``   how bad it is among those of its reason.
    ``link``   the address of what explains it, by the name of ``link_name``.
    """

    reason: Reason
    name: str
    address: str
    words: str
    size: float
    link: str
    link_name: str


@lru_cache(maxsize=4)
def matters(overview: Overview) -> tuple[Matter, ...]:
    """All of them, most urgent first; made once for all pages that show the same."""
    found: dict[str, Matter] = {}
    for matter in (*_failed(overview), *_missed(overview), *_worse(overview)):
        found.setdefault(matter.address, matter)
    order = list(Reason)
    return tuple(sorted(found.values(), key=lambda one: (order.index(one.reason), -one.size)))


def gaps(demanded: Thresholds, run: RunNumbers) -> list[tuple[float, str]]:
    """By how much a run misses each of what is demanded, and that in words; the largest first."""
    found = []
    for name, least, value in (
        ("recall", demanded.min_recall, run.recall),
        ("precision", demanded.min_precision, run.precision),
    ):
        if least is not None and value is None:
            found.append((1.0, f"{name} was not measured; at least {exact_percent(least)} is set"))
        elif least is not None and value is not None and value < least:
            short = least - value
            words = f"{name} is {percent(value)}, {points(short)} below {exact_percent(least)}"
            found.append((short, words))
    most = demanded.max_overhang
    if most is not None and run.overhang is None:
        found.append((1.0, f"overhang was not measured; at most {exact_percent(most)} is set"))
    elif most is not None and run.overhang is not None and run.overhang > most:
        over = run.overhang - most
        words = f"overhang is {overhang(run.overhang)}, {points(over)} above {exact_percent(most)}"
        found.append((over, words))
    return sorted(found, key=lambda one: -one[0])


def _failed(overview: Overview) -> Iterator[Matter]:
    for one in overview.failed:
        reason = sentence(one.failure.detail)
        words = f"The upload of {one.name} failed. {failure_title(one.failure)}. {reason}"
        job = f"/jobs/{one.job_id}"
        address = f"/assets/{one.asset_id}" if one.asset_id else job
        yield Matter(
            Reason.FAILED, one.asset or one.name, address, words, one.ended, job, "See why"
        )


def _missed(overview: Overview) -> Iterator[Matter]:
    for line in overview.lines:
        found = gaps(line.demanded, line.latest) if line.latest else []
        if found:
            size, words = found[0]
            address = f"/assets/{line.id}"
            yield Matter(
                Reason.MISSED, line.name, address, sentence(words), size, address, "See the asset"
            )


def _worse(overview: Overview) -> Iterator[Matter]:
    for change in overview.worse:
        address, runs = f"/assets/{change.line.id}", comparison_address(change)
        words = sentence(_fall(change))
        yield Matter(
            Reason.WORSE, change.line.name, address, words, change.fall, runs, "Compare the runs"
        )


def _fall(change: Change) -> str:
    """The largest of its falls in words."""
    falls = [
        (pair[0] - pair[1], f"{name} fell from {percent(pair[0])} to {percent(pair[1])}")
        for name, pair in (("recall", change.recall), ("precision", change.precision))
        if pair is not None
    ]
    if change.overhang is not None:
        before, after = change.overhang
        falls.append(
            (after - before, f"overhang rose from {overhang(before)} to {overhang(after)}")
        )
    return max(falls)[1]


def comparison_address(change: Change) -> str:
    """Of the two runs."""
    assert change.line.latest is not None  # else nothing would have changed
    runs = {"a": change.before.job_id, "b": change.line.latest.job_id}
    return f"/compare?{urlencode(runs)}"
