"""How far a whole job is, from what the library tells of its parts."""

from __future__ import annotations

import time
from collections.abc import Mapping

import simplifier
from service.engines.worker import Tell
from service.jobs.progress import JobProgress

MAKING = {
    "voxelize": 0.04, "fill": 0.03, "surface": 0.02, "sections": 0.08, "loops": 0.02,
    "chains": 0.03, "cut": 0.15, "refine": 0.58, "accuracy": 0.05,
}  # fmt: skip
"""Share of the time that each stage of a level takes, roughly: of meshes of all sizes."""

JUDGING = {"voxelize": 0.2, "fill": 0.1, "surface": 0.05, "accuracy": 0.65}

_COARSER = 0.8  # of the time of a level that the next coarser one takes


class Meter:
    """Turns progress of parts into progress of the job; its fraction never falls."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._begin = time.perf_counter()
        self._fraction = 0.0

    @property
    def seconds(self) -> float:
        """Since the job began."""
        return time.perf_counter() - self._begin

    def at(self, stage: str, fraction: float) -> None:
        """The job is at a stage and so far."""
        self._say(stage, fraction, None, 0, 1)

    def counted(self, stage: str, fraction: float, done: int, of: int) -> None:
        """The same, where the stage is so many pieces."""
        self._say(stage, fraction, None, done, of)

    def part(self, begin: float, end: float, shares: Mapping[str, float]) -> _Part:
        """A listener for a call that takes the job from one fraction to another."""
        return _Part(self, begin, end, shares)

    def _say(
        self, stage: str, fraction: float, measure: float | None, level: int, levels: int
    ) -> None:
        self._fraction = max(self._fraction, min(fraction, 1.0))
        self._tell(JobProgress(stage, self._fraction, measure, level, levels, self.seconds))


class _Part:
    """The listener of one call."""

    def __init__(self, meter: Meter, begin: float, end: float, shares: Mapping[str, float]) -> None:
        self._meter, self._begin, self._end = meter, begin, end
        self._shares = shares

    def __call__(self, progress: simplifier.Progress) -> None:
        share = _done(progress, self._shares)
        fraction = self._begin + (self._end - self._begin) * share
        self._meter._say(
            progress.stage, fraction, progress.measure, progress.level, progress.levels
        )


def _done(progress: simplifier.Progress, shares: Mapping[str, float]) -> float:
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
