"""What the command line shows: progress, the report as a table, an error as one line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import TextIOWrapper
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from simplifier.progress import STAGES, Listener, Progress
from simplifier.wording import (
    grid_size,
    length,
    mean_and_worst,
    percent,
    percent_at_most,
    seconds,
    verdict_words,
)

_UNBROKEN = 1000  # columns

_NAMES = {
    "load": "reading the mesh",
    "voxelize": "voxelizing",
    "fill": "filling the solid",
    "surface": "meshing the voxels",
    "sections": "cutting sections",
    "loops": "tracing outlines",
    "chains": "simplifying outlines",
    "cut": "choosing polygons",
    "refine": "refining triangles",
    "accuracy": "measuring accuracy",
    "write": "writing",
}


@contextmanager
def progress_bar() -> Iterator[Listener]:
    """A bar on standard error that follows the stages; nothing where that is not a terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda progress: None
        return
    columns = (TextColumn("{task.description:<31}"), BarColumn(), _Figures())
    with Bars(*columns, console=console, transient=True) as bars:
        task = bars.add_task("starting", total=len(STAGES), measure=None)

        def listen(progress: Progress) -> None:
            done = progress.level * len(STAGES) + STAGES.index(progress.stage) + progress.share
            which = f"{progress.level + 1}/{progress.levels} " if progress.levels > 1 else ""
            bars.update(
                task, completed=done / progress.levels, measure=progress.measure,
                description=f"{which}{_NAMES[progress.stage]} {progress.share:4.0%}",
            )  # fmt: skip

        yield listen


class _Figures(ProgressColumn):
    """Seconds since the start, and the occlusion measure when there is one."""

    def render(self, task: Task) -> Text:
        measure = task.fields["measure"]
        shown = "" if measure is None else f"  measure {percent(measure)}"
        return Text(f"{task.elapsed or 0.0:.1f} s{shown}")


@contextmanager
def run_bar(runs: int) -> Iterator[Callable[[int, str], None]]:
    """A bar on standard error that is told how many runs are done and what runs now."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, name: None
        return
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[name]}", markup=False),
    )
    with Bars(*columns, console=console, transient=True) as bars:
        task = bars.add_task("", total=runs, name="warming up")

        def tell(done: int, name: str) -> None:
            bars.update(task, completed=done, name=_printable(name))

        yield tell


@contextmanager
def count_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error that is told how many of ``what`` are done, and of how many."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda done, total: None
        return
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bars(*columns, console=console, transient=True) as bars:
        task = bars.add_task("", total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


def print_front(title: str, rows: Sequence[tuple[str, str, str, str, str]]) -> None:
    """A Pareto front as a table on standard output: setting, time, recall, precision, overhang."""
    table = Table(title=Text(_printable(title)), title_justify="left")
    table.add_column("setting")
    for column in ("time", "recall", "precision", "overhang"):
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    Console(soft_wrap=True).print(table)


def print_text(line: str) -> None:
    """One line on standard output, as plain text."""
    print(_printable(line))


def print_report(report: dict[str, Any], name: str) -> None:
    """The report's headline figures as a table on standard output, and its verdict.

    A verdict that is not good is a warning, on standard error, with what to try next.
    """
    print_rows(name, _rows(report))
    if report.get("levels"):
        _print_levels(report)
    verdict = report["verdict"]
    if verdict["word"] == "good":
        print_text(verdict_words(verdict))
    else:
        _print_warnings([verdict_words(verdict)])
    if verdict["next"]:
        print_line(f"try: {verdict['next']}")
    _print_warnings(report["warnings"])


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Rows under named columns as a table on standard output: all but the first, the last and
    verdicts as numbers."""
    table = Table(title=Text(_printable(title)), title_justify="left")
    for place, column in enumerate(columns):
        number = 0 < place < len(columns) - 1 and column != "verdict"
        table.add_column(column, justify="right" if number else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(_printable(cell)) for cell in row))
    # Where no terminal would break long lines, in the log of a CI run, neither does the table.
    console = Console()
    Console(width=console.width if console.is_terminal else _UNBROKEN).print(table)


def print_rows(title: str, rows: Sequence[tuple[str, str]], warnings: Sequence[str] = ()) -> None:
    """Named values as a table on standard output, and warnings on standard error."""
    table = Table(title=Text(_printable(title)), show_header=False, title_justify="left")
    table.add_column(style="bold")
    table.add_column(justify="right")
    for label, value in rows:
        table.add_row(label, value)
    Console(soft_wrap=True).print(table)
    _print_warnings(warnings)


def _print_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        print_line(f"warning: {warning}")


def _print_levels(report: dict[str, Any]) -> None:
    """A row a level of detail, then why others were left out."""
    # As narrow as a terminal: eight columns leave no room for lines between them.
    table = Table(
        title="levels of detail", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    names = (
        "level", "verdict", "triangles", "recall", "precision", "overhang", "error bound",
        "from distance",
    )  # fmt: skip
    for name in names:
        whole = name in ("verdict", "triangles", "recall", "precision", "overhang")
        table.add_column(name, justify="left" if name == "verdict" else "right", no_wrap=whole)
    for level in report["levels"]:
        table.add_row(
            str(level["level"]), level["verdict"]["word"], f"{level['triangles']:,}",
            percent(level["recall"], 2), percent(level["precision"], 2),
            percent_at_most(level["overhang"]["share"]), length(level["error_bound"]),
            length(level["switch_distance"]),
        )  # fmt: skip
    Console(soft_wrap=True).print(table)
    for one in report["left_out"]:
        print_text(f"left out: {one['resolution']:,} voxels: {one['reason']}")


def print_line(message: str) -> None:
    """One line on standard error, as plain text."""
    print(_printable(message), file=sys.stderr)


def accept_any_text() -> None:
    """Let standard output escape what its encoding lacks: a file name must not end a run."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _printable(text: str) -> str:
    """One line without what a terminal would obey: file names hold any byte but NUL and slash."""
    line = " ".join(text.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def _rows(report: dict[str, Any]) -> list[tuple[str, str]]:
    worst, over, front = report["worst_view"], report["overhang"], report["front"]
    rows = [
        ("verdict", report["verdict"]["word"]),
        ("triangles", f"{report['input']['triangles']:,} -> {report['triangles']:,}"),
        ("precision", percent(report["precision"], 2)),
        ("recall", percent(report["recall"], 2)),
        (
            "worst view",
            f"recall {percent(worst['recall'], 2)}, precision {percent(worst['precision'], 2)}",
        ),
        ("overhang", mean_and_worst(over["share"], over["worst_view"]["share"])),
        ("stick-out", length(over["stick_out"])),
        ("front", mean_and_worst(front["share"], front["worst_view"]["share"])),
        ("occlusion measure kept", percent(report["occlusion_measure"]["ratio"], 2)),
        ("error bound", length(report["error_bound"])),
        ("deviation", length(report["deviation"])),
        ("solid", f"{grid_size(report['solid']['resolution'])} voxels"),
    ]
    timings = {stage: time for stage, time in report["timings"].items() if time > 0.0}
    rows += [(f"time: {stage}", seconds(time)) for stage, time in timings.items()]
    return rows
