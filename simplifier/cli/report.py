"""What the commands that judge one occluder share: a progress bar, a report, a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from simplifier.cli.allocator import keep_freed_memory
from simplifier.cli.console import print_json, print_line, print_report, progress_bar
from simplifier.cli.help import OUTPUT
from simplifier.cli.running import Interrupts, interrupts, run_guarded
from simplifier.errors import OptionError, OutputError
from simplifier.io.files import check_apart, check_folder
from simplifier.io.places import is_folder, is_there
from simplifier.progress import Listener
from simplifier.report.report import Report

Strict = Annotated[
    bool,
    typer.Option(
        "--strict", help="Exit with status 1 unless the verdict is good.", rich_help_panel=OUTPUT
    ),
]


@dataclass(frozen=True)
class Outcome:
    """What a command on one occluder has come to.

    ``made``     what was made, and where; empty where nothing was.
    ``then``     what to do with an occluder that is good.
    ``current``  whether it was there already.
    """

    report: Report
    made: str = ""
    then: str = ""
    current: bool = False


@dataclass(frozen=True)
class Shown:
    """How much a command shows, as its options of the same names say."""

    strict: bool = False
    verbose: bool = False
    quiet: bool = False
    as_json: bool = False
    debug: bool = False


def run_and_show(
    work: Callable[[Listener, Interrupts], Outcome | None], name: str, shown: Shown
) -> None:
    """Run a command under a progress bar and show its report, if there is one.

    Exits with status 1 if the report has to say that the occluder is good, and does not.
    """
    good = False
    keep_freed_memory()

    def run() -> None:
        nonlocal good
        with interrupts() as listening:
            with progress_bar() as listener:
                found = work(listener, listening)
            with listening.held():
                if found is not None:
                    made = f"{'current' if found.current else 'made'}: {found.made}"
                    print_report(
                        found.report, name,
                        made=made if found.made else "", then=found.then, verbose=shown.verbose,
                    )  # fmt: skip
                    print_json(found.report)
                    good = found.report["verdict"]["word"] == "good"
                if shown.strict and not good:
                    known = "is not good" if found is not None else "is not known to be good"
                    print_line(f"error: {name}: the occluder {known}")

    run_guarded(run, debug=shown.debug, quiet=shown.quiet, as_json=shown.as_json)
    if shown.strict and not good:
        raise typer.Exit(1)


_PAGES = (".html", ".htm")


def check_extras(
    report: Path | None, pictures: Path | None, others: Sequence[tuple[Path, str]]
) -> None:
    """Refuse now what could not be written after all the work, or is not what its name says.

    ``others``  what a run reads and writes besides, each with what it is.
    """
    if report is not None:
        check_folder(report)
        check_apart([report], "the report", others)
        if report.suffix.lower() in _PAGES:
            raise OptionError(
                "a report is JSON, and no page",
                where="--report",
                remedy=f"write --report {report.stem}.json, or --pictures FOLDER for a page",
            )
    if pictures is not None:
        if is_there(pictures) and not is_folder(pictures):
            raise OutputError(
                "this is not a folder", where=str(pictures), remedy="name one for the pictures"
            )
        check_apart([pictures], "the pictures", others)
