"""One self-contained HTML page about speed against accuracy: nothing is fetched or executed.

Pictures are data URIs, one for light and one for dark, and the page's own security policy forbids
all else.  This module makes words of the figures; the markup is in ``page.html``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from simplifier.options.tradeoff import TradeoffOptions
from simplifier.report.machine import Machine
from simplifier.report.templates import page_html, png_address
from simplifier.tradeoff import words
from simplifier.tradeoff.advice import FEWEST_CASES, STEP, Advice, KnobAdvice, Pay, Step
from simplifier.tradeoff.cases import Case, Judged
from simplifier.tradeoff.plot import DARK, LIGHT, case_picture
from simplifier.tradeoff.sweep import Outcome
from simplifier.version import VERSION
from simplifier.wording import (
    count,
    exact_percent,
    median_points,
    percent,
    percent_at_most,
    points,
    short_seconds,
)

Tile = tuple[str, str, str]
"""What it is about, its value and a note."""


def page_text(
    found: Sequence[Outcome],
    cases: Sequence[Case],
    advice: Advice,
    options: TradeoffOptions,
    machine: Machine,
    precision: float,
) -> str:
    """The page as HTML text.

    ``found``  all outcomes, of which ``cases`` and ``advice`` are made at the stated ``precision``.
    """
    names = list(dict.fromkeys(outcome.trial.mesh for outcome in found))
    return page_html(
        "tradeoff/page.html",
        heading="Speed against accuracy:",
        name=names[0] if len(names) == 1 else f"{len(names)} meshes",
        colours={
            name: {knob or "several": colour for knob, colour in theme.knobs.items()}
            for name, theme in (("light", LIGHT), ("dark", DARK))
        },
        summary=_summary(found, options, machine, precision),
        failures=_unbroken(words.failure_lines(found)),
        warnings=_unbroken(words.warning_lines(found)),
        tiles=[_more_tile(advice), _less_tile(advice), _never_tile(advice), _size_tile(cases)],
        advice=_unbroken(words.advice_lines(advice)),
        knobs=[_knob_cells(item, advice.cases) for item in advice.by_gain],
        never=_unbroken(words.never_lines(advice, precision)),
        pays=[_pay_cells(pay) for pay in advice.pays],
        meshes=[
            _mesh_values(name, mine, precision)
            for name in names
            if (mine := [case for case in cases if case.mesh == name])
        ],
        reading=_reading(precision),
        colophon=f"planar-occluder {VERSION}, seed {options.seed}, {machine}",
    )


def _summary(
    found: Sequence[Outcome], options: TradeoffOptions, machine: Machine, precision: float
) -> str:
    runs = sum(outcome.repeats for outcome in found if outcome.trial.setting is not None)
    sweep = "every combination" if options.full else "one knob at a time"
    ground = f", standing on the ground, up {options.up}" if options.ground else ""
    return (
        f"{runs:,} runs, {sweep} around the default{ground}; at least {exact_percent(precision)} "
        f"precision. Measured on {machine}."
    )


def _more_tile(advice: Advice) -> Tile:
    first = next((item for item in advice.by_gain if item.slower), None)
    if first is None or first.gain <= 0.0:
        return "For more recall", "no knob", "slower settings recall no more"
    gain = f"{points(first.gain)} of recall a doubling of time"
    return "For more recall, turn first", first.knob, gain


def _less_tile(advice: Advice) -> Tile:
    first = next((item for item in advice.by_loss if item.faster), None)
    if first is None:
        return "For less time", "no knob", "no setting is faster by a quarter"
    loss = f"{points(-first.loss)} of recall a halving of time"
    return "For less time, turn first", first.knob, loss


def _never_tile(advice: Advice) -> Tile:
    values = [pay.value for pay in advice.pays if pay.never]
    note = "dominated in every case"
    if not values and advice.cases < FEWEST_CASES:
        return "Never pays", "too early to say", f"takes {FEWEST_CASES} cases or more"
    if not values:
        note = "every value is on some front"
    shown = values if len(values) <= 2 else [*values[:2], f"{len(values) - 2} more"]
    return "Never pays", ", ".join(shown) or "nothing", note


def _size_tile(cases: Sequence[Case]) -> Tile:
    settings = sum(len(case.measured) for case in cases)
    front = sum(len(case.front) for case in cases)
    return "On the front", f"{front} of {settings}", "settings, over all meshes and budgets"


def _knob_cells(item: KnobAdvice, cases: int) -> tuple[str, str, str, str]:
    """The knob, and what a slower, a faster and an equally fast step of it bring."""
    level = [step.gain for step in item.level]
    same = f"{median_points(level)} in {count(len(level), 'setting')}" if level else "-"
    return item.knob, _steps(item.slower, 1.0, cases), _steps(item.faster, -1.0, cases), same


def _steps(steps: Sequence[Step], sign: float, cases: int) -> str:
    if not steps:
        return "-"
    gains = median_points([sign * step.per_doubling for step in steps])
    return gains if len(steps) == cases else f"{gains} in {len(steps)} of {cases}"


def _pay_cells(pay: Pay) -> tuple[str, str, str, str]:
    """The knob, its value, how often that is on a front, and what dominates it elsewhere."""
    paid = f"{pay.paid} of {pay.cases}" if pay.cases else "never precise enough"
    return pay.knob, pay.value, paid, ", ".join(pay.rivals[:3]) or "-"


def _mesh_values(name: str, cases: Sequence[Case], precision: float) -> dict[str, Any]:
    """A mesh: a picture and a table for every budget."""
    return {
        "name": name,
        "has_several": any(item.setting.knob is None for case in cases for item in case.judged),
        "cases": [_case_values(case, precision) for case in cases],
    }


def _case_values(case: Case, precision: float) -> dict[str, Any]:
    front, measured = len(case.front), len(case.measured)
    steps = [f"{i.setting.name} {short_seconds(i.seconds)} {percent(i.recall)}" for i in case.front]
    return {
        "title": f"Budget {case.budget:,}",
        "light": png_address(case_picture(case, LIGHT)),
        "dark": png_address(case_picture(case, DARK)),
        "front": f"Time against recall. The front: {'; '.join(steps) or 'empty'}",
        "caption": f"{front} of {measured} settings {'is' if front == 1 else 'are'} on the front",
        "rows": [_setting_values(item, precision) for item in case.ranked],
    }


def _setting_values(item: Judged, precision: float) -> dict[str, Any]:
    figures: tuple[str, ...] = ("-",) * 4
    if item.verdict != "failed":
        figures = (
            short_seconds(item.seconds), percent(item.recall), percent(item.precision, 2),
            percent_at_most(item.overhang),
        )  # fmt: skip
    return {
        "verdict": item.verdict,
        "knob": item.setting.knob or "several",
        "name": item.setting.name,
        "figures": figures,
        "standing": _unbroken([words.standing(item, precision)])[0],
    }


def _unbroken(lines: Sequence[str]) -> list[str]:
    """The lines, with no line end between a number and its unit."""
    return [re.sub(r"(?<=\d) (?=%|m?s\b)", "\u00a0", line) for line in lines]


def _reading(precision: float) -> tuple[str, ...]:
    """What the words on the page mean."""
    return (
        "Recall is the share of what the mesh hides that the occluder hides too; precision the "
        "share of what the occluder hides that is truly hidden. Both are exact, from 256 views.",
        "Overhang is what the occluder covers beside the mesh, as a share of its silhouette. All "
        "settings aim for the same, so the front does not depend on it.",
        "Time runs from the mesh in memory to the triangles, kernels warm, the median of the "
        "runs. A setting called time has a time limit: less shortens the preset's work, more goes "
        "on refining.",
        f"A setting is dominated when another one of at least {exact_percent(precision)} precision "
        "takes no more time and recalls no less; the front is what is left. The dominating setting "
        "that is named is the one of most recall.",
        "The gain of a knob is taken from the default, balanced: the recall that the next slower "
        f"setting of that knob alone adds (its time longer by a factor of {STEP:g} or more), "
        "divided by the doublings of time.",
        "A case is a mesh at a budget.",
    )
