"""How far a whole job is, from what the library tells of its parts."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import simplifier
from service.engines.worker import ReportProgress
from service.jobs.progress import JobProgress, Snapshot

MAKING = {
    "voxelize": 0.04, "fill": 0.03, "surface": 0.02, "sections": 0.08, "loops": 0.02,
    "chains": 0.03, "cut": 0.15, "refine": 0.58, "accuracy": 0.05,
}  # fmt: skip
"""Share of the time that each stage of a level takes, roughly: of meshes of all sizes."""

JUDGING = {"voxelize": 0.2, "fill": 0.1, "surface": 0.05, "accuracy": 0.65}

_COARSER = 0.8  # of the time of a level that the next coarser one takes

Draw = Callable[[simplifier.Progress], Snapshot | None]
"""Gives a picture of the best so far, where one is due."""


class Meter:
    """Turns progress of parts into progress of the job; its fraction never falls."""

    def __init__(self, tell: ReportProgress) -> None:
        self._tell = tell
        self._begin = time.perf_counter()
        self._fraction = 0.0

    @property
    def seconds(self) -> float:
        """Since the job began."""
        return time.perf_counter() - self._begin

    def at(self, stage: str, fraction: float) -> None:
        """The job is at a stage and so far."""
        self._say(JobProgress(stage, fraction))

    def at_count(self, stage: str, fraction: float, done: int, of: int) -> None:
        """The job is at a stage of so many pieces, and some of them are done."""
        self._say(JobProgress(stage, fraction, None, done, of))

    def part(
        self,
        begin: float,
        end: float,
        shares: Mapping[str, float],
        draw: Draw = lambda progress: None,
    ) -> _Part:
        """A listener for a call that takes the job from one fraction to another."""
        return _Part(self, begin, end, shares, draw)

    def _say(self, progress: JobProgress) -> None:
        self._fraction = max(self._fraction, min(progress.fraction, 1.0))
        self._tell(replace(progress, fraction=self._fraction, seconds=self.seconds))


class _Part:
    """The listener of one call."""

    def __init__(
        self, meter: Meter, begin: float, end: float, shares: Mapping[str, float], draw: Draw
    ) -> None:
        self._meter, self._begin, self._end = meter, begin, end
        self._shares, self._draw = shares, draw

    def __call__(self, progress: simplifier.Progress) -> None:
        share = _share_done(progress, self._shares)
        fraction = self._begin + (self._end - self._begin) * share
        self._meter._say(
            JobProgress(
                progress.stage, fraction, progress.measure, progress.level, progress.levels,
                picture=self._draw(progress),
            )
        )  # fmt: skip


def _share_done(progress: simplifier.Progress, shares: Mapping[str, float]) -> float:
    """The share of the whole call, 0 to 1."""
    before = 0.0
    for stage, share in shares.items():
        if stage == progress.stage:
            before += share * progress.share
            break
        before += share
    weights = [_COARSER**level for level in range(progress.levels)]
    done = sum(weights[: progress.level]) + weights[progress.level] * before
    return done / sum(weights)
