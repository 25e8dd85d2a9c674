"""A line on standard error for each mesh under way."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from simplifier.cli.plugin import percent, print_line, print_text

_LONGEST_NAME = 32


class SubmissionBars:
    """The lines, by the name of the mesh; nothing where standard error is no terminal.

    Lines may begin and change in any thread; they end, and text is printed, in one.
    """

    def __init__(self, bars: Progress | None) -> None:
        self._bars = bars
        self._tasks: dict[str, TaskID] = {}

    def begin(self, name: str) -> None:
        if self._bars is not None:
            shown = name if len(name) <= _LONGEST_NAME else f"...{name[3 - _LONGEST_NAME :]}"
            self._tasks[name] = self._bars.add_task(escape(shown), total=1.0, now="", measure="")

    def tell(self, name: str, now: str, share: float, measure: float | None) -> None:
        if self._bars is not None:
            reached = "" if measure is None else f"measure {percent(measure)}"
            self._bars.update(self._tasks[name], completed=share, now=now, measure=reached)

    def end(self, name: str) -> None:
        if self._bars is not None:
            self._bars.remove_task(self._tasks.pop(name))

    def print(self, line: str, *, failed: bool) -> None:
        """Print a line that stays: on standard error for a failure, else on standard output."""
        if self._bars is not None:
            self._bars.stop()  # in one terminal the two would mix
        (print_line if failed else print_text)(line)
        if self._bars is not None:
            self._bars.start()


@contextmanager
def submission_bars() -> Iterator[SubmissionBars]:
    console = Console(stderr=True)
    if not console.is_terminal:
        yield SubmissionBars(None)
        return
    columns = (
        TextColumn("{task.description:<32}"),
        BarColumn(),
        TextColumn("{task.fields[now]:<12} {task.fields[measure]}", markup=False),
        TimeElapsedColumn(),
    )

    with Progress(*columns, console=console, transient=True, redirect_stdout=False) as bars:
        yield SubmissionBars(bars)
