"""The pieces of the page about speed against accuracy; each escapes the words it is given."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from html import escape

from simplifier.tradeoff import words
from simplifier.tradeoff.advice import STEP, Advice, KnobAdvice, Pay, Step
from simplifier.tradeoff.cases import Case, Judged
from simplifier.wording import count, exact_percent, median_points, percent, points, short_seconds

Pictures = tuple[bytes, bytes]
"""PNG for light and for dark pages."""

_SEVERAL = '<li><b class="several">&#10010;</b> resolution / directions / time</li>'
_MARKS = (
    '<li><b class="preset">&#9670;</b> preset</li>'
    '<li><b class="resolution">&#9632;</b> resolution</li>'
    '<li><b class="directions">&#9650;</b> directions</li>'
    '<li><b class="time">&#9679;</b> time</li>'
)
_SHAPES = (
    '<li><i class="stair"></i> Pareto front; its settings are filled</li>'
    "<li>hollow: dominated</li><li>crossed out: too imprecise</li>"
    "<li>&#9661; at the edge: far below, its recall beside it</li>"
)


def warnings(failures: Sequence[str], notes: Sequence[str]) -> str:
    """What failed and what to know, in boxes that cannot be overlooked; or nothing."""
    return _box("No result", failures) + _box("Please note", notes)


def _box(title: str, lines: Sequence[str]) -> str:
    if not lines:
        return ""
    items = f"<b>{escape(title)}</b><ul>{sentences(lines)}</ul>"
    return f'<section class="warnings" role="alert">{items}</section>'


def tiles(advice: Advice, cases: Sequence[Case]) -> str:
    """The headline figures."""
    shown = [_more_tile(advice), _less_tile(advice), _never_tile(advice), _size_tile(cases)]
    return "".join(
        f"<div><dt>{escape(label)}</dt><dd>{escape(value)}<small>{escape(note)}</small></dd></div>"
        for label, value, note in shown
    )


def sentences(lines: Sequence[str]) -> str:
    """List items."""
    return "".join(f"<li>{_unbroken(line)}</li>" for line in lines)


def never(lines: Sequence[str]) -> str:
    """What never pays, or that everything does somewhere."""
    if not lines:
        return "<p>Nothing: every value is on the front of some mesh and budget.</p>"
    return f'<ul class="said">{sentences(lines)}</ul>'


def knobs(advice: Advice) -> str:
    """What each knob brings from where the default stands."""
    rows = "".join(_knob_row(item, advice.cases) for item in advice.by_gain)
    head = _head(("Knob", "Slower: a doubling of time", "Faster: a halving", "As fast"))
    caption = "Recall from the default on, points: the median (and range) over the cases"
    return _table(caption, head, rows)


def pays(advice: Advice) -> str:
    """How often each value is on a front."""
    rows = "".join(map(_pay_row, advice.pays))
    caption = "On the front, of the cases in which it was precise enough"
    return _table(caption, _head(("Setting", "On the front", "Else dominated by")), rows)


def mesh(name: str, cases: Sequence[Case], pictures: Sequence[Pictures], precision: float) -> str:
    """A mesh: a picture and a table for every budget."""
    cards = "".join(
        _case(case, both, precision) for case, both in zip(cases, pictures, strict=True)
    )
    several = any(item.setting.knob is None for case in cases for item in case.judged)
    legend = f'<ul class="legend">{_MARKS}{_SEVERAL if several else ""}{_SHAPES}</ul>'
    return f'<h2><bdi>{escape(name)}</bdi></h2>{legend}<div class="cases grid">{cards}</div>'


def reading(precision: float) -> str:
    """What the words on the page mean."""
    told = (
        "Recall is the share of what the mesh hides that the occluder hides too; precision the "
        "share of what the occluder hides that is truly hidden. Both are exact, from 256 views.",
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
    return "".join(f"<p>{escape(line)}</p>" for line in told)


def _more_tile(advice: Advice) -> tuple[str, str, str]:
    first = next((item for item in advice.by_gain if item.slower), None)
    if first is None or first.gain <= 0.0:
        return "For more recall", "no knob", "slower settings recall no more"
    gain = f"{points(first.gain)} of recall a doubling of time"
    return "For more recall, turn first", first.knob, gain


def _less_tile(advice: Advice) -> tuple[str, str, str]:
    first = next((item for item in advice.by_loss if item.faster), None)
    if first is None:
        return "For less time", "no knob", "no setting is faster by a quarter"
    loss = f"{points(-first.loss)} of recall a halving of time"
    return "For less time, turn first", first.knob, loss


def _never_tile(advice: Advice) -> tuple[str, str, str]:
    values = [pay.value for pay in advice.pays if pay.cases and not pay.paid]
    note = "dominated in every case" if values else "every value is on some front"
    shown = values if len(values) <= 2 else [*values[:2], f"{len(values) - 2} more"]
    return "Never pays", ", ".join(shown) or "nothing", note


def _size_tile(cases: Sequence[Case]) -> tuple[str, str, str]:
    settings = sum(len(case.measured) for case in cases)
    front = sum(len(case.front) for case in cases)
    return "On the front", f"{front} of {settings}", "settings, over all meshes and budgets"


def _knob_row(item: KnobAdvice, cases: int) -> str:
    level = [step.gain for step in item.level]
    same = f"{median_points(level)} in {count(len(level), 'setting')}" if level else "-"
    cells = (_steps(item.slower, 1.0, cases), _steps(item.faster, -1.0, cases), same)
    return _row("", _knob_word(item.knob), *map(escape, cells))


def _steps(steps: Sequence[Step], sign: float, cases: int) -> str:
    if not steps:
        return "-"
    told = median_points([sign * step.per_doubling for step in steps])
    return told if len(steps) == cases else f"{told} in {len(steps)} of {cases}"


def _knob_word(knob: str) -> str:
    return f'<b class="{escape(knob)}">{escape(knob)}</b>'


def _pay_row(pay: Pay) -> str:
    name = f'<span class="{escape(pay.knob)}">{escape(pay.value)}</span>'
    count = f"{pay.paid} of {pay.cases}" if pay.cases else "never precise enough"
    return _row("", name, escape(count), escape(", ".join(pay.rivals[:3]) or "-"))


_COLUMNS = ("Setting", "Time", "Recall", "Precision", "Standing")


def _case(case: Case, pictures: Pictures, precision: float) -> str:
    front, all_ = len(case.front), len(case.measured)
    title = f"<h3>Budget {case.budget:,}</h3>"
    caption = f"{front} of {all_} settings {'is' if front == 1 else 'are'} on the front"
    rows = "".join(_setting_row(item, precision) for item in case.ranked)
    table = _table(caption, _head(_COLUMNS, 3), rows)
    return f'<section class="card">{title}{_picture(case, pictures)}{table}</section>'


def _setting_row(item: Judged, precision: float) -> str:
    knob = item.setting.knob or "several"
    name = f'<span class="{escape(knob)}">{escape(item.setting.name)}</span>'
    told = _unbroken(words.standing(item, precision))
    if item.verdict == "failed":
        return _row("failed", name, "-", "-", "-", told)
    figures = (short_seconds(item.seconds), percent(item.recall), percent(item.precision, 2))
    return _row(item.verdict, name, *map(escape, figures), told, numbers=3)


def _picture(case: Case, pictures: Pictures) -> str:
    light, dark = (f"data:image/png;base64,{base64.b64encode(p).decode()}" for p in pictures)
    return (
        f'<figure><picture><source media="(prefers-color-scheme: dark)" srcset="{dark}">'
        f'<img src="{light}" width="1280" height="880" alt="{escape(_spoken(case))}"></picture>'
        "</figure>"
    )


def _spoken(case: Case) -> str:
    """The front in words, for who cannot see it."""
    steps = [f"{i.setting.name} {short_seconds(i.seconds)} {percent(i.recall)}" for i in case.front]
    return "Time against recall. The front: " + ("; ".join(steps) or "empty")


def _unbroken(line: str) -> str:
    """Escaped, and no line ends between a number and its unit."""
    return re.sub(r"(?<=\d) (?=%|m?s\b)", "\u00a0", escape(line))


def _head(names: Sequence[str], numbers: int = 0) -> str:
    """Column heads; ``numbers`` of them, after the first, stand over figures."""
    cells = "".join(
        f"<th scope=col{' class=number' if 0 < index <= numbers else ''}>{escape(name)}</th>"
        for index, name in enumerate(names)
    )
    return f"<thead><tr>{cells}</tr></thead>"


def _row(kind: str, name: str, *cells: str, numbers: int = 0) -> str:
    """Name and cells are HTML; the first ``numbers`` cells are set to the right."""
    shown = "".join(
        f"<td{' class=number' if index < numbers else ''}>{cell}</td>"
        for index, cell in enumerate(cells)
    )
    return f"<tr{f' class={kind}' if kind else ''}><th scope=row>{name}</th>{shown}</tr>"


def _table(caption: str, head: str, rows: str) -> str:
    inside = f"<caption>{escape(caption)}</caption>{head}<tbody>{rows}</tbody>"
    return f'<div class="scroll"><table>{inside}</table></div>'
