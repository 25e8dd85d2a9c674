"""What a sweep teaches, in sentences for the terminal and the page alike."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Sequence

from simplifier.options.tradeoff import TradeoffOptions
from simplifier.tradeoff.advice import (
    FEWEST_CASES,
    STEP,
    Advice,
    KnobAdvice,
    Pay,
    Step,
)
from simplifier.tradeoff.cases import Judged
from simplifier.tradeoff.sweep import Outcome, settings_of
from simplifier.wording import count, exact_percent, median_points, points, short_seconds


def advice_lines(advice: Advice) -> list[str]:
    """Which knob to turn first, for more recall and for less time, and what triangles bring."""
    return [*_more(advice), *_less(advice), *_triangles(advice)]


def never_lines(advice: Advice, precision: float) -> list[str]:
    """The values that are on no front, and those that are nowhere precise enough.

    From few cases nothing is said never to pay.
    """
    lines, few = [], []
    for pay in advice.pays:
        if pay.cases == 0:
            where = _in_all(pay.imprecise)
            lines.append(f"{_subject(pay)} below {exact_percent(precision)} precision {where}.")
        elif pay.paid == 0 and not pay.never:
            few.append(pay)
        elif pay.never:
            rivals = _or(pay.rivals[:2])
            lines.append(
                f"{_capital(pay.value)} never {_verb(pay, 'pay')}: {_in_all(pay.cases)} another "
                f"setting is as fast and recalls as much, most often {rivals}."
            )
    return [*lines, *_few(few)]


def _few(pays: Sequence[Pay]) -> list[str]:
    """What was on no front of few cases, in one sentence."""
    if not pays:
        return []
    most = max(pay.cases for pay in pays)
    names = _and([pay.value for pay in pays])
    return [
        f"On no front so far: {names}. {count(most, 'case').capitalize()} cannot tell whether they "
        f"ever pay; that takes {FEWEST_CASES} cases or more (a case is a mesh at a budget)."
    ]


def failure_lines(found: Sequence[Outcome]) -> list[str]:
    """What has no result, and why."""
    return [f"{_place(o)}: {o.trial.failure}" for o in found if o.trial.failure]


def left_lines(found: Sequence[Outcome], options: TradeoffOptions) -> list[str]:
    """How many settings of a mesh the sweep had no time for."""
    if options.within is None:
        return []
    planned = len(settings_of(options))
    run = Counter(outcome.trial.mesh for outcome in found if outcome.trial.setting is not None)
    return [
        f"{mesh}: there was no time for {planned - done:,} of {count(planned, 'setting')}; allow "
        f"more than {short_seconds(options.within)}"
        for mesh, done in run.items()
        if done < planned
    ]


def warning_lines(found: Sequence[Outcome]) -> list[str]:
    """What the runs warned of, each once a mesh, with the settings that it is about."""
    measured: dict[str, set[str]] = {}
    about: dict[tuple[str, str], dict[str, None]] = {}
    for trial in (outcome.trial for outcome in found):
        if trial.setting is None or trial.failure:
            continue
        measured.setdefault(trial.mesh, set()).add(trial.setting.name)
        for warning in trial.warnings:
            about.setdefault((trial.mesh, warning), {})[trial.setting.name] = None
    lines = []
    for (mesh, warning), names in about.items():
        some = "" if len(names) == len(measured[mesh]) else f", {_and(list(names))}"
        lines.append(f"{mesh}{some}: {warning}")
    return lines


def standing(item: Judged, precision: float) -> str:
    """How a setting stands, with what dominates it and by how much."""
    if item.verdict == "front":
        return "on the front"
    if item.verdict == "failed":
        return f"failed: {item.outcome.trial.failure}"
    if item.verdict == "imprecise" or item.dominator is None:
        return f"below {exact_percent(precision)} precision: not compared"
    other = item.dominator.trial
    name = "" if other.setting is None else other.setting.name
    return (
        f"dominated by {name}: {_faster(item.seconds / other.seconds)}, "
        f"{_more_points(other.recall - item.recall)}"
    )


def _more(advice: Advice) -> list[str]:
    gains = [item for item in advice.by_gain if item.slower]
    if not gains:
        return [f"For more recall: no step from the default takes {STEP:g} times its time or more."]
    first, *rest = gains
    if first.gain <= 0.0:
        return [
            "For more recall: no knob gains; a slower setting recalls no more than the default."
        ]
    lead = (
        f"For more recall, turn {_knob(first)} first: {points(first.gain)} a doubling of time "
        f"(median of {count(len(first.slower), 'case')}; {_example(first.slower)})."
    )
    return [lead, *_then([(item.knob, item.gain, item.slower) for item in rest])]


def _less(advice: Advice) -> list[str]:
    losses = [item for item in advice.by_loss if item.faster]
    if not losses:
        return []
    first, *rest = losses
    lead = (
        f"For less time, turn {_knob(first)} first: {points(-first.loss)} a halving of time "
        f"(median of {count(len(first.faster), 'case')}; {_example(first.faster)})."
    )
    return [lead, *_then([(item.knob, -item.loss, item.faster) for item in rest])]


def _then(knobs: Sequence[tuple[str, float, Sequence[Step]]]) -> list[str]:
    if not knobs:
        return []
    told = [f"{knob} {points(gain)} ({count(len(steps), 'case')})" for knob, gain, steps in knobs]
    return [f"Then: {', '.join(told)}."]


def _triangles(advice: Advice) -> list[str]:
    if not advice.triangles:
        return []
    return [
        f"A doubling of the budget brings {median_points(advice.triangles)} points by default, but "
        "those triangles are drawn in every frame."
    ]


def _knob(item: KnobAdvice) -> str:
    return f"the {item.knob}"


def _example(steps: Sequence[Step]) -> str:
    """The step that is most frequent among the cases, and what it does to the time."""
    names = [step.item.setting.name for step in steps]
    name = max(dict.fromkeys(names), key=names.count)
    ratio = statistics.median(step.ratio for step in steps if step.item.setting.name == name)
    return f"{name} takes {ratio:.2g} times as long"


def _subject(pay: Pay) -> str:
    return f"{_capital(pay.value)} {'are' if pay.knob == 'directions' else 'is'}"


def _verb(pay: Pay, verb: str) -> str:
    return verb if pay.knob == "directions" else f"{verb}s"


def _in_all(count: int) -> str:
    return {1: "in the one case measured", 2: "in both cases"}.get(count, f"in all {count} cases")


def _or(names: Sequence[str]) -> str:
    return " or ".join(names)


def _and(names: Sequence[str]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"


def _place(outcome: Outcome) -> str:
    setting = outcome.trial.setting
    within = "" if setting is None else f", budget {setting.budget}, {setting.name}"
    return f"{outcome.trial.mesh}{within}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _faster(ratio: float) -> str:
    if ratio < 1.005:
        return "as fast"
    return f"{100.0 * (1.0 - 1.0 / ratio):.0f} % less time"


def _more_points(gain: float) -> str:
    return "the same recall" if round(gain * 100.0, 1) == 0.0 else points(gain)
