"""What the command line shows: progress, the report as a table, an error as one line.

Progress, warnings and errors go to standard error, all else to standard output.  What draws tables
and bars is loaded when there is one to draw: most starts print a line.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from enum import Enum, auto
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, Literal

from simplifier.cli.progress_lines import ProgressLines
from simplifier.progress import STAGES, Listener, Progress
from simplifier.wording import (
    distance_range,
    grid_size,
    length,
    mean_and_worst,
    percent,
    percent_at_most,
    seconds,
    verdict_words,
)

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from simplifier.cli.bars import Bars

_UNBROKEN = 1000  # columns


class Printed(Enum):
    """What a command prints beside warnings and errors."""

    ALL = auto()
    JSON = auto()
    """Progress, and on standard output what :func:`print_json` is told, nothing else."""
    NOTHING = auto()

    @classmethod
    def of(cls, quiet: bool, as_json: bool) -> Printed:
        """By what was typed: JSON that was asked for is printed in any case."""
        return cls.JSON if as_json else cls.NOTHING if quiet else cls.ALL


_printed = ContextVar("printed", default=Printed.ALL)


@contextmanager
def printing(what: Printed) -> Iterator[None]:
    """Within the block, print that much."""
    token = _printed.set(what)
    try:
        yield
    finally:
        _printed.reset(token)


def print_json(value: Any) -> None:
    """A value as JSON on standard output, if that is what is printed."""
    if _printed.get() is Printed.JSON:
        print(json.dumps(value, indent=2, allow_nan=False))


def print_json_line(value: Any) -> None:
    """As :func:`print_json`, in one line: several make JSON Lines."""
    if _printed.get() is Printed.JSON:
        with _above_bars():
            print(json.dumps(value, allow_nan=False), flush=True)


def _prints_text() -> bool:
    return _printed.get() is Printed.ALL


def _tells_progress() -> bool:
    return _printed.get() is not Printed.NOTHING


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


def _console(**settings: Any) -> Console:
    from rich.console import Console

    return Console(**settings)


def _table(title: str, **settings: Any) -> Table:
    from rich.table import Table
    from rich.text import Text

    return Table(title=Text(_printable(title)), title_justify="left", **settings)


@contextmanager
def progress_bar() -> Iterator[Listener]:
    """A bar on standard error that follows the stages; lines where that is not a terminal."""
    console = _console(stderr=True)
    if not _tells_progress():
        yield lambda progress: None
        return
    if not console.is_terminal:
        lines = ProgressLines()
        yield lambda progress: lines.tell(lambda: _stage_words(progress))
        return
    from simplifier.cli.bars import stage_bars

    with _shown(stage_bars(console)) as bars:
        task = bars.add_task("starting", total=len(STAGES), measure=None)

        def listen(progress: Progress) -> None:
            done = progress.level * len(STAGES) + STAGES.index(progress.stage) + progress.share
            bars.update(
                task, completed=done / progress.levels, measure=progress.measure,
                description=_stage_words(progress),
            )  # fmt: skip

        yield listen


def _stage_words(progress: Progress) -> str:
    """``"3/4 choosing polygons  50%"``."""
    which = f"{progress.level + 1}/{progress.levels} " if progress.levels > 1 else ""
    return f"{which}{_NAMES[progress.stage]} {progress.share:4.0%}"


@contextmanager
def run_bar(runs: int) -> Iterator[Callable[[int, str], None]]:
    """A bar on standard error that is told how many runs are done and what runs now."""
    console = _console(stderr=True)
    if not _tells_progress():
        yield lambda done, name: None
        return
    if not console.is_terminal:
        lines = ProgressLines()
        yield lambda done, name: lines.tell(lambda: f"{done} of {runs}: {_printable(name)}")
        return
    from simplifier.cli.bars import run_bars

    with _shown(run_bars(console)) as bars:
        task = bars.add_task("", total=runs, name="warming up")

        def tell(done: int, name: str) -> None:
            bars.update(task, completed=done, name=_printable(name))

        yield tell


@contextmanager
def count_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on standard error that is told how many of ``what`` are done, and of how many."""
    console = _console(stderr=True)
    if not _tells_progress():
        yield lambda done, total: None
        return
    if not console.is_terminal:
        lines = ProgressLines()
        yield lambda done, total: lines.tell(lambda: f"{what}: {done:,} of {total:,}")
        return
    from simplifier.cli.bars import count_bars

    with _shown(count_bars(console, what)) as bars:
        task = bars.add_task("", total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)


def print_progress(line: str) -> None:
    """A line on standard error that is no warning: not where nothing is to be printed."""
    if _tells_progress():
        print_line(f"progress: {line}")


_bars: list[Bars] = []


@contextmanager
def _shown(bars: Bars) -> Iterator[Bars]:
    """Show bars; those under way, which would take turns with them on one line, stop meanwhile."""
    if _bars:
        _bars[-1].stop()
    _bars.append(bars)
    try:
        with bars:
            yield bars
    finally:
        _bars.pop()
        if _bars:
            _bars[-1].start()


@contextmanager
def _above_bars() -> Iterator[None]:
    """Bars make room meanwhile: they take all that is printed for their terminal's."""
    bars = _bars[-1] if _bars else None
    if bars is not None:
        bars.stop()
    try:
        yield
    finally:
        if bars is not None:
            bars.start()


def print_front(title: str, rows: Sequence[tuple[str, str, str, str, str]]) -> None:
    """A Pareto front as a table on standard output: setting, time, recall, precision, overhang."""
    if not _prints_text():
        return
    table = _table(title)
    table.add_column("setting")
    for column in ("time", "recall", "precision", "overhang"):
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    _console(soft_wrap=True).print(table)


def print_text(line: str) -> None:
    """One line on standard output, as plain text."""
    if _prints_text():
        with _above_bars():
            print(_printable(line))


def print_report(
    report: dict[str, Any], name: str, *, made: str = "", then: str = "", verbose: bool = False
) -> None:
    """The report's headline figures as a table on standard output, then as the last lines what was
    made, how good it is, and what to do next.

    A verdict that is not good is a warning, on standard error, with what to try next.

    ``made``     a line on what was made, and where; empty where nothing was.
    ``then``     what to do with a result that is good.
    ``verbose``  whether the table has the time of every stage.
    """
    print_rows(name, _rows(report, verbose))
    if report.get("levels"):
        _print_levels(report)
    _print_warnings(report["warnings"])
    verdict = report["verdict"]
    if made:
        print_text(made)
    if verdict["word"] == "good":
        print_text(verdict_words(verdict))
    else:
        _print_warnings([verdict_words(verdict)])
    if verdict["next"]:
        print_line(f"try: {verdict['next']}")
    elif then:
        print_text(f"next: {then}")


def print_closing(made: str, good: str, then: str) -> None:
    """The last three lines of a command: what was made and where, how good it is, and what to do
    next."""
    print_text(f"made: {made}")
    print_text(good)
    print_text(f"next: {then}")


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Rows under named columns as a table on standard output: all but the first, the last and
    verdicts as numbers."""
    if not _prints_text():
        return
    table = _table(title)
    for place, column in enumerate(columns):
        number = 0 < place < len(columns) - 1 and column != "verdict"
        table.add_column(column, justify="right" if number else "left", overflow="fold")
    from rich.text import Text

    for row in rows:
        table.add_row(*(Text(_printable(cell)) for cell in row))
    _print_whole(table)


def _print_whole(table: Table) -> None:
    """Where no terminal would break long lines, in the log of a CI run, neither does the table."""
    console = _console()
    _console(width=console.width if console.is_terminal else _UNBROKEN).print(table)


def print_rows(title: str, rows: Sequence[tuple[str, str]], warnings: Sequence[str] = ()) -> None:
    """Named values as a table on standard output, and warnings on standard error."""
    if _prints_text():
        table = _table(title, show_header=False)
        table.add_column(style="bold")
        table.add_column(justify="right")
        for label, value in rows:
            table.add_row(label, value)
        _console(soft_wrap=True).print(table)
    _print_warnings(warnings)


def _print_warnings(warnings: Sequence[str]) -> None:
    for warning in warnings:
        print_line(f"warning: {warning}")


def _print_levels(report: dict[str, Any]) -> None:
    """A row a level of detail, then why others were left out."""
    if not _prints_text():
        return
    # As narrow as a terminal: eight columns leave no room for lines between them.
    from rich.box import SIMPLE_HEAD

    table = _table("levels of detail", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    names = (
        "level", "verdict", "triangles", "recall", "precision", "overhang", "error bound",
        "distance",
    )  # fmt: skip
    for name in names:
        whole = name not in ("level", "error bound")
        justify: Literal["left", "right"] = "left" if name == "verdict" else "right"
        table.add_column(name, justify=justify, no_wrap=whole, overflow="fold")
    starts = [level["switch_distance"] for level in report["levels"]]
    for level in report["levels"]:
        table.add_row(
            str(level["level"]), level["verdict"]["word"], f"{level['triangles']:,}",
            percent(level["recall"], 2), percent(level["precision"], 2),
            percent_at_most(level["overhang"]["share"]), length(level["error_bound"]),
            distance_range(level["level"], starts),
        )  # fmt: skip
    _print_whole(table)
    for one in report["left_out"]:
        print_text(f"left out: {one['resolution']:,} voxels: {one['reason']}")


def print_line(message: str) -> None:
    """One line on standard error, as plain text."""
    with _above_bars():
        print(_printable(message), file=sys.stderr)


def accept_any_text() -> None:
    """Let standard output escape what its encoding lacks: a file name must not end a run."""
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def _printable(text: str) -> str:
    """One line without what a terminal would obey: file names hold any byte but NUL and slash."""
    line = " ".join(text.split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


def _rows(report: dict[str, Any], verbose: bool) -> list[tuple[str, str]]:
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
    rows.append(("time", seconds(sum(timings.values()))))
    if verbose:
        rows += [(f"time: {stage}", seconds(time)) for stage, time in timings.items()]
    return rows
