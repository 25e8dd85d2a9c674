"""What a sweep teaches: which knob to turn first, and which settings never pay.

A knob's gain is taken where the default stands.  Its next step is the nearest setting with only
that knob turned whose time differs from the default's by a quarter or more, for less would divide
by noise; the gain is the recall that the step adds, divided by the doublings of time that it costs.
"""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.sweep import KNOBS, Knob

STEP = 1.25
"""Least ratio of times that counts as a step."""

FEWEST_CASES = 10
"""Least cases from which a value may be said never to pay: what is on none of ten fronts is, at
95 %, on less than 26 % of all (1 - 0.05^(1/10)); of three it might be on 63 %."""


@dataclass(frozen=True)
class Step:
    """From the default to a setting: ``ratio`` of their times, and the recall that it adds."""

    case: Case
    item: Judged
    ratio: float
    gain: float

    @property
    def per_doubling(self) -> float:
        """Recall a doubling of time; for a faster setting what a halving loses."""
        return self.gain / math.log2(self.ratio)


@dataclass(frozen=True)
class KnobAdvice:
    """A knob's next steps, one a case at most: to ``slower`` settings, to ``faster`` ones, and
    ``level``: all that leave the time about as it is."""

    knob: Knob
    slower: tuple[Step, ...]
    faster: tuple[Step, ...]
    level: tuple[Step, ...]

    @property
    def gain(self) -> float:
        """Median recall that a doubling of time adds, minus infinity where no step is slower."""
        return median(self.slower, -math.inf)

    @property
    def loss(self) -> float:
        """Median recall that a halving of time costs, infinity where no step is faster."""
        return median(self.faster, math.inf)


@dataclass(frozen=True)
class Pay:
    """How often a value of a knob is on the front.

    ``value``  in words; ``cases`` in which it was precise enough, ``paid`` those of them with the
    value on the front, ``imprecise`` those in which it never was precise enough.
    ``rivals``  the settings that dominate it, most frequent first.
    """

    knob: Knob
    value: str
    cases: int
    paid: int
    imprecise: int
    rivals: tuple[str, ...]

    @property
    def never(self) -> bool:
        """Whether it is on no front, in enough cases to say that it never will be."""
        return self.paid == 0 and self.cases >= FEWEST_CASES


@dataclass(frozen=True)
class Advice:
    """``knobs`` in the order of :data:`KNOBS`; ``pays`` of every value, in the order of the sweep;
    ``triangles`` recall that a doubling of the budget adds, by case, from one to the next;
    ``cases`` that all is drawn from."""

    knobs: tuple[KnobAdvice, ...]
    pays: tuple[Pay, ...]
    triangles: tuple[float, ...]
    cases: int

    @property
    def by_gain(self) -> list[KnobAdvice]:
        """Most gain first, but last those with a slower step in less than half of the cases."""
        return sorted(self.knobs, key=lambda k: (2 * len(k.slower) < self.cases, -k.gain))

    @property
    def by_loss(self) -> list[KnobAdvice]:
        """Least loss first, but last those with a faster step in less than half of the cases."""
        return sorted(self.knobs, key=lambda k: (2 * len(k.faster) < self.cases, k.loss))


def advise(cases: Sequence[Case]) -> Advice:
    """What the cases teach."""
    return Advice(
        tuple(_knob_advice(cases, knob) for knob in KNOBS),
        tuple(_pays(cases)),
        tuple(_per_doubled_budget(cases)),
        len(cases),
    )


def median(steps: Sequence[Step], otherwise: float) -> float:
    """Of the recall a doubling."""
    return statistics.median(step.per_doubling for step in steps) if steps else otherwise


def _knob_advice(cases: Sequence[Case], knob: Knob) -> KnobAdvice:
    slower, faster, level = [], [], []
    for case in cases:
        steps = sorted(_steps(case, knob), key=lambda step: step.ratio)
        level += [step for step in steps if 1.0 / STEP < step.ratio < STEP]
        slower += [step for step in steps if step.ratio >= STEP][:1]
        faster += [step for step in steps if step.ratio <= 1.0 / STEP][-1:]
    return KnobAdvice(knob, tuple(slower), tuple(faster), tuple(level))


def _steps(case: Case, knob: Knob) -> Iterable[Step]:
    start = case.default
    if start is None or not start.counts:
        return
    for item in case.judged:
        if item.counts and item is not start and item.setting.knob == knob:
            yield Step(case, item, item.seconds / start.seconds, item.recall - start.recall)


def _pays(cases: Sequence[Case]) -> Iterable[Pay]:
    values: dict[tuple[Knob, str], list[list[Judged]]] = {}
    for case in cases:
        mine: dict[tuple[Knob, str], list[Judged]] = {}
        for item in case.measured:
            turned = item.setting.departures or {"preset": item.setting.preset}
            for knob in KNOBS:
                if knob in turned:
                    mine.setdefault((knob, turned[knob]), []).append(item)
        for key, items in mine.items():
            values.setdefault(key, []).append(items)
    for (knob, value), by_case in values.items():
        yield _pay(knob, value, by_case)


def _pay(knob: Knob, value: str, by_case: Sequence[Sequence[Judged]]) -> Pay:
    fit = [items for items in by_case if any(item.counts for item in items)]
    paid = sum(any(item.verdict == "front" for item in items) for items in fit)
    rivals = Counter(
        item.dominator.trial.setting.name
        for items in fit
        for item in items
        if item.dominator is not None and item.dominator.trial.setting is not None
    )
    ranked = tuple(name for name, _ in rivals.most_common())
    return Pay(knob, value, len(fit), paid, len(by_case) - len(fit), ranked)


def _per_doubled_budget(cases: Sequence[Case]) -> Iterable[float]:
    for mesh in dict.fromkeys(case.mesh for case in cases):
        mine = sorted((c for c in cases if c.mesh == mesh), key=lambda case: case.budget)
        for less, more in pairwise(mine):
            if less.default is not None and more.default is not None:
                gain = more.default.recall - less.default.recall
                yield gain / math.log2(more.budget / less.budget)
