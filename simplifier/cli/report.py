"""What the commands that judge one occluder share: a progress bar, a report, a table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from simplifier.cli.console import print_report, progress_bar
from simplifier.cli.running import Interrupts, interrupts, run_guarded
from simplifier.errors import OutputError
from simplifier.io.files import check_folder
from simplifier.progress import Listener
from simplifier.report.report import Report


def run_and_show(
    work: Callable[[Listener, Interrupts], Report | None], name: str, *, debug: bool
) -> None:
    """Run a command under a progress bar and show its report, if there is one."""

    def run() -> None:
        with interrupts() as listening:
            with progress_bar() as listener:
                report = work(listener, listening)
            with listening.held():
                if report is not None:
                    print_report(report, name)

    run_guarded(run, debug=debug)


def check_extras(report: Path | None, pictures: Path | None) -> None:
    """Refuse now what could not be written after all the work."""
    if report is not None:
        check_folder(report)
    if pictures is not None and pictures.exists() and not pictures.is_dir():
        raise OutputError(
            "this is no folder", where=str(pictures), remedy="name one for the pictures"
        )
