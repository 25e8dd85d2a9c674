"""Which settings are worth their time: the Pareto front of every mesh and budget.

The Pareto front of cost against value, and what keeps every other point off it.

A point dominates another when it costs no more, is worth no less, and is better in one of the two.
The front holds the points that nothing dominates; equal points on it do not dominate each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from simplifier.errors import OptionError
from simplifier.tradeoff.sweep import DEFAULT, Outcome, Setting

SettingVerdict = Literal["front", "dominated", "imprecise", "failed"]
"""On the front; another is as fast and recalls as much; below the stated precision, so neither on
the front nor measured against it; no result."""


@dataclass(frozen=True)
class Judged:
    """An outcome, how it stands among those of its mesh and budget, and what dominates it."""

    outcome: Outcome
    verdict: SettingVerdict
    dominator: Outcome | None = None

    @property
    def setting(self) -> Setting:
        setting = self.outcome.trial.setting
        assert setting is not None  # a mesh that could not be read is no case
        return setting

    @property
    def seconds(self) -> float:
        return self.outcome.trial.seconds

    @property
    def recall(self) -> float:
        return self.outcome.trial.recall

    @property
    def precision(self) -> float:
        return self.outcome.trial.precision

    @property
    def overhang(self) -> float:
        return self.outcome.trial.overhang

    @property
    def counts(self) -> bool:
        """Whether it is precise enough to be compared."""
        return self.verdict in ("front", "dominated")


@dataclass(frozen=True)
class Case:
    """All that was measured of a mesh at a budget, in the order in which it ran."""

    mesh: str
    budget: int
    judged: tuple[Judged, ...]

    @property
    def front(self) -> list[Judged]:
        """The front, fastest first."""
        return self._fastest_first("front")

    @property
    def measured(self) -> list[Judged]:
        """All that have a result."""
        return [item for item in self.judged if item.verdict != "failed"]

    @property
    def ranked(self) -> list[Judged]:
        """The front, then the dominated, the imprecise and the failed, each fastest first."""
        verdicts: tuple[SettingVerdict, ...] = ("front", "dominated", "imprecise", "failed")
        return [item for verdict in verdicts for item in self._fastest_first(verdict)]

    @property
    def default(self) -> Judged | None:
        """The setting that the others depart from, None where it was not measured or failed."""
        plain = Setting(self.budget, DEFAULT)
        return next((item for item in self.measured if item.setting == plain), None)

    def _fastest_first(self, verdict: SettingVerdict) -> list[Judged]:
        return sorted(
            (item for item in self.judged if item.verdict == verdict), key=lambda item: item.seconds
        )


def judge_cases(found: Sequence[Outcome], precision: float) -> list[Case]:
    """The outcomes by mesh and budget, in the order in which they come.

    ``precision``  the least, 0 to 1, that a setting must reach to be compared.  Meshes that could
    not be read are left out.  Raises :class:`OptionError` for a precision out of range.
    """
    check_precision(precision)
    groups: dict[tuple[str, int], list[Outcome]] = {}
    for outcome in found:
        if outcome.trial.setting is not None:
            key = (outcome.trial.mesh, outcome.trial.setting.budget)
            groups.setdefault(key, []).append(outcome)
    return [Case(*key, _judge_group(group, precision)) for key, group in groups.items()]


def check_precision(precision: float) -> None:
    """Raise :class:`OptionError` unless it is a share."""
    if not 0.0 <= precision <= 1.0:
        raise OptionError(
            f"{precision!r} is out of range", where="precision", remedy="choose 0 to 1"
        )


def _judge_group(group: Sequence[Outcome], precision: float) -> tuple[Judged, ...]:
    fit = [o for o in group if not o.trial.failure and o.trial.precision >= precision]
    found = dominators([o.trial.seconds for o in fit], [o.trial.recall for o in fit])
    by_setting = {o.trial.setting: d for o, d in zip(fit, found, strict=True)}

    def judge(outcome: Outcome) -> Judged:
        if outcome.trial.failure:
            return Judged(outcome, "failed")
        if outcome.trial.setting not in by_setting:
            return Judged(outcome, "imprecise")
        dominator = by_setting[outcome.trial.setting]
        if dominator is None:
            return Judged(outcome, "front")
        return Judged(outcome, "dominated", fit[dominator])

    return tuple(map(judge, group))


def dominators(costs: Sequence[float], values: Sequence[float]) -> list[int | None]:
    """For every point the front's point that dominates it, None for those on the front.

    ``costs``, ``values``  of n points each, finite.  Where several front points dominate one, it is
    the one of most value; of equals the cheapest, then the first.
    """
    found: list[int | None] = [None] * len(costs)
    best: int | None = None  # of most value among the points that cost no more
    for point in sorted(range(len(costs)), key=lambda i: (costs[i], -values[i], i)):
        if best is None or values[point] > values[best]:
            best = point
        elif (costs[point], values[point]) != (costs[best], values[best]):
            found[point] = best
    return found
