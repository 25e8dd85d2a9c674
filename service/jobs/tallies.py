"""What is counted of jobs that have ended, each of them once, over all servers and restarts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from service.jobs.job import Failure, JobKind, JobState, Summary

BOUNDS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0)
"""Seconds: a job is counted by the first of these that it took no longer than, if any."""

ALL_STAGES = "all"


class Counted(StrEnum):
    """What is counted, and by which labels."""

    ENDED = "ended"
    """Kind and state."""
    FAILED = "failed"
    """What it failed of."""
    SECONDS = "seconds"
    """Kind, stage and the bound of :data:`BOUNDS`, ``inf`` beyond all."""


Labels = tuple[str, ...]
"""Of :class:`Counted`, then the labels."""


@dataclass(frozen=True)
class Tally:
    """How many there were, and the total of their seconds where these are counted."""

    count: int
    total: float = 0.0

    def __add__(self, other: Tally) -> Tally:
        return Tally(self.count + other.count, self.total + other.total)


class Tallies(Protocol):
    """The counts of jobs that have ended."""

    def totals(self) -> Mapping[Labels, Tally]:
        """Of all that have ended by now."""


def labels_of(
    kind: JobKind, state: JobState, failure: Failure | None, summary: Summary | None
) -> Iterator[tuple[Labels, Tally]]:
    """What a job is counted by.

    ``summary``  of what was done for it; None for a stored result, which took no time now.
    """
    yield (Counted.ENDED, kind, state), Tally(1)
    if failure is not None:
        yield (Counted.FAILED, failure.kind), Tally(1)
    if summary is not None:
        for stage, seconds in {**summary.timings, ALL_STAGES: summary.seconds}.items():
            bound = next((str(one) for one in BOUNDS if seconds <= one), "inf")
            yield (Counted.SECONDS, kind, stage, bound), Tally(1, seconds)
