"""What the commands that judge one occluder share: a progress bar, a report, a table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from simplifier.cli.console import print_line, print_report, progress_bar
from simplifier.cli.running import Interrupts, interrupts, run_guarded
from simplifier.errors import OutputError
from simplifier.io.files import check_folder
from simplifier.progress import Listener
from simplifier.report.report import Report

Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with status 1 unless the verdict is good.")
]


def run_and_show(
    work: Callable[[Listener, Interrupts], Report | None],
    name: str,
    *,
    debug: bool,
    strict: bool = False,
) -> None:
    """Run a command under a progress bar and show its report, if there is one.

    ``strict``  exit with status 1 unless the report says that the occluder is good.
    """
    good = False

    def run() -> None:
        nonlocal good
        with interrupts() as listening:
            with progress_bar() as listener:
                report = work(listener, listening)
            with listening.held():
                if report is not None:
                    print_report(report, name)
                    good = report["verdict"]["word"] == "good"
                if strict and not good:
                    known = "is not good" if report is not None else "is not known to be good"
                    print_line(f"error: {name}: the occluder {known}")

    run_guarded(run, debug=debug)
    if strict and not good:
        raise typer.Exit(1)


def check_extras(report: Path | None, pictures: Path | None) -> None:
    """Refuse now what could not be written after all the work."""
    if report is not None:
        check_folder(report)
    if pictures is not None and pictures.exists() and not pictures.is_dir():
        raise OutputError(
            "this is no folder", where=str(pictures), remedy="name one for the pictures"
        )
