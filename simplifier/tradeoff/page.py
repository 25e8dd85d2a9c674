"""One self-contained HTML page about speed against accuracy: nothing is fetched or executed.

Pictures are data URIs, one for light and one for dark, and the page's own security policy forbids
all else.  Every word that comes from outside is escaped.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from string import Template

from simplifier.options.tradeoff import TradeoffOptions
from simplifier.report.machine import Machine
from simplifier.tradeoff import parts, words
from simplifier.tradeoff.advice import Advice
from simplifier.tradeoff.cases import Case
from simplifier.tradeoff.plot import DARK, LIGHT, case_picture
from simplifier.tradeoff.sweep import Outcome
from simplifier.version import VERSION


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
    template = Template((Path(__file__).parent / "page.html").read_text("utf-8"))
    return template.substitute(
        _colours(),
        title=escape(names[0] if len(names) == 1 else f"{len(names)} meshes"),
        summary=escape(_summary(found, options, machine, precision)),
        warnings=parts.warnings(words.failure_lines(found), words.warning_lines(found)),
        tiles=parts.tiles(advice, cases),
        advice=parts.sentences(words.advice_lines(advice)),
        knobs=parts.knobs(advice),
        never=parts.never(words.never_lines(advice, precision)),
        pays=parts.pays(advice),
        meshes="".join(_mesh(name, cases, precision) for name in names),
        reading=parts.reading(precision),
        colophon=escape(f"planar-occluder {VERSION}, seed {options.seed}, {machine}"),
    )


def _mesh(name: str, cases: Sequence[Case], precision: float) -> str:
    mine = [case for case in cases if case.mesh == name]
    pictures = [(case_picture(case, LIGHT), case_picture(case, DARK)) for case in mine]
    return parts.mesh(name, mine, pictures, precision) if mine else ""


def _summary(
    found: Sequence[Outcome], options: TradeoffOptions, machine: Machine, precision: float
) -> str:
    runs = sum(outcome.repeats for outcome in found if outcome.trial.setting is not None)
    sweep = "every combination" if options.full else "one knob at a time"
    ground = f", standing on the ground, up {options.up}" if options.ground else ""
    return (
        f"{runs:,} runs, {sweep} around the default{ground}; at least {words.share(precision)} "
        f"precision. Measured on {machine}."
    )


def _colours() -> dict[str, str]:
    return {
        f"{name}_{knob or 'several'}": colour
        for name, theme in (("light", LIGHT), ("dark", DARK))
        for knob, colour in theme.knobs.items()
    }
