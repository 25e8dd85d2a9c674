"""Bars on a terminal, which takes a while to load: only where one is shown."""

from __future__ import annotations

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from simplifier.wording import percent

Bars = Progress


class _Figures(ProgressColumn):
    """Seconds since the start, and the occlusion measure when there is one."""

    def render(self, task: Task) -> Text:
        measure = task.fields["measure"]
        shown = "" if measure is None else f"  measure {percent(measure)}"
        return Text(f"{task.elapsed or 0.0:.1f} s{shown}")


def stage_bars(console: Console) -> Bars:
    """Of tasks with a description and a ``measure``."""
    return _bars(console, TextColumn("{task.description:<31}"), BarColumn(), _Figures())


def run_bars(console: Console) -> Bars:
    """Of tasks with a ``name``."""
    name = TextColumn("{task.fields[name]}", markup=False)
    return _bars(console, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), name)


def count_bars(console: Console, what: str) -> Bars:
    """Of so many of ``what``."""
    return _bars(console, TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())


def _bars(console: Console, *columns: ProgressColumn) -> Bars:
    return Bars(*columns, console=console, transient=True)
