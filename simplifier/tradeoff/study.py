"""A sweep, judged: its files, and what the terminal shows of it.

``occluder tradeoff`` as one call: a mesh at many settings, each run timed and judged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simplifier.checks import as_path, check_callable, check_cancel, check_kind
from simplifier.errors import CancelledError
from simplifier.geometry.mesh import A_MESH, TriangleMesh
from simplifier.geometry.overrides import NO_OVERRIDES, OVERRIDES, Overrides
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.progress import Cancel, Deadline, TellTotalStep
from simplifier.report.machine import Machine, this_machine
from simplifier.tradeoff import words
from simplifier.tradeoff.advice import Advice, advise
from simplifier.tradeoff.cases import Case, judge_cases
from simplifier.tradeoff.journal import Journal
from simplifier.tradeoff.sweep import Outcome, Trial, mesh_trials, outcomes, settings_of
from simplifier.tradeoff.table import json_bytes, rows_of, tradeoff_csv
from simplifier.wording import percent, percent_at_most, short_seconds

FrontRow = tuple[str, str, str, str, str]
"""Setting, time, recall, precision, overhang."""


@dataclass(frozen=True)
class Study:
    """All that a sweep gave.

    ``outcomes``  of every setting, failures among them; ``cases`` and ``advice`` are made of them
    at the stated ``precision``.
    """

    options: TradeoffOptions
    precision: float
    machine: Machine
    outcomes: tuple[Outcome, ...]
    cases: tuple[Case, ...]
    advice: Advice

    @property
    def warnings(self) -> list[str]:
        """What failed, what was not run in time, then what the runs warned of."""
        return [
            *words.failure_lines(self.outcomes),
            *words.left_lines(self.outcomes, self.options),
            *words.warning_lines(self.outcomes),
        ]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row a setting, as ``tradeoff.json`` has them."""
        return rows_of(self.outcomes, self.cases)

    @property
    def fronts(self) -> list[tuple[str, list[FrontRow]]]:
        """A title and the rows of every front, fastest first."""
        return [(f"{case.mesh}, budget {case.budget:,}", _rows(case)) for case in self.cases]

    @property
    def lines(self) -> list[str]:
        """The advice, and what never pays; nothing where nothing was measured."""
        if not any(case.measured for case in self.cases):
            return []
        return words.advice_lines(self.advice) + words.never_lines(self.advice, self.precision)

    def files(self) -> Iterator[tuple[str, bytes]]:
        """As :func:`study_files`."""
        return study_files(self)


def study_of(trials: Sequence[Trial], options: TradeoffOptions, precision: float) -> Study:
    """Judge the trials of a sweep, also of one that was cut short.

    Raises :class:`OptionError` for a precision out of 0 to 1.
    """
    found = outcomes(trials)
    cases = judge_cases(found, precision)
    return Study(options, precision, this_machine(), tuple(found), tuple(cases), advise(cases))


def study_files(study: Study) -> Iterator[tuple[str, bytes]]:
    """``tradeoff.csv``, ``.json``, ``.png`` and ``.html``: names and contents, each made when asked
    for.

    The table comes first, for it is what cannot be had again without measuring.
    """
    table = tradeoff_csv(study.outcomes, study.cases, study.options, study.machine)
    yield "tradeoff.csv", table
    yield "tradeoff.json", json_bytes(study.rows, study.precision, study.machine, study.lines)
    # Here, not above: matplotlib takes half a second to import, and most runs draw nothing.
    from simplifier.tradeoff.page import page_text
    from simplifier.tradeoff.plot import overview_picture

    yield "tradeoff.png", overview_picture(study.cases, study.precision, str(study.machine))
    page = page_text(
        study.outcomes, study.cases, study.advice, study.options, study.machine, study.precision
    )
    yield "tradeoff.html", page.encode("utf-8", "replace")


def _rows(case: Case) -> list[FrontRow]:
    return [
        (
            i.setting.name,
            short_seconds(i.seconds),
            percent(i.recall),
            percent(i.precision, 2),
            percent_at_most(i.overhang),
        )
        for i in case.front
    ]


def sweep_tradeoff(
    mesh: TriangleMesh,
    options: TradeoffOptions,
    *,
    name: str = "mesh",
    tell: TellTotalStep = lambda done, runs, now: None,
    cancel: Cancel | None = None,
    overrides: Overrides = NO_OVERRIDES,
    journal: str | Path | None = None,
) -> Study:
    """Measure what more time buys on a mesh, which tables and pages call ``name``.

    ``overrides`` hold for every run; the mesh was loaded with what they ignore.

    ``journal``    a file that runs are kept in as they come.  What is in it of the same sweep is
                   not run again; it is removed once the sweep is whole.

    What ``tell`` raises ends the sweep.  ``cancel``, once set, ends it soon.  Raises
    :class:`~simplifier.errors.CancelledError` then, however much was measured.
    """
    check_kind("mesh", mesh, TriangleMesh, A_MESH)
    check_kind("options", options, TradeoffOptions, "simplifier.TradeoffOptions")
    check_callable("tell", tell)
    check_cancel(cancel)
    check_kind("overrides", overrides, Overrides, OVERRIDES)
    runs = len(settings_of(options)) * options.repeats

    def told(done: int, now: str) -> object:
        return tell(done, runs, now)

    keeper = None if journal is None else Journal.open(as_path("journal", journal), options)
    deadline = Deadline.after(options.within)
    trials = list(mesh_trials(name, mesh, options, deadline, told, cancel, overrides, keeper))
    if cancel is not None and cancel.is_set():
        raise CancelledError(f"cancelled after {len(trials)} of {runs} runs")
    tell(runs, runs, "writing")
    if keeper is not None:
        keeper.end()
    return study_of(trials, options, options.precision)
