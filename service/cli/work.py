"""The command that does the jobs of servers on another machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.command import run_command
from simplifier.cli.plugin import Debug, print_line


def work(
    until_idle: Annotated[
        float | None,
        typer.Option(
            "--until-idle",
            min=0.0,
            metavar="SECONDS",
            help="End when for so long there was no job to take.",
            show_default="never",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder for work under way, of this worker alone.",
            show_default="OCCLUDER_DATA or occluder_data",
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Do the jobs of servers that share a database, on any machine, and answer nobody.

    It needs the database (OCCLUDER_DATABASE_URL) and the bucket (OCCLUDER_BLOBS) of the servers,
    and none of their secrets: see docs/operations.md.  Exit status: 0 there was nothing to do any
    more, or it was told to end; 1 it could not work, and says why; 2 it is set up wrongly.

    Ctrl-C (or SIGTERM) gives running jobs back, for others to do, and ends; once more ends it at
    once.
    """

    def run() -> int:
        # Here, not above: 'occluder work --help' need not have a database installed.
        from service.cli.worker_host import run_worker
        from service.settings import read_settings, unknown_settings

        settings = read_settings({"data": data})
        for line in unknown_settings():
            print_line(f"warning: {line}")
        return run_worker(settings, until_idle)

    run_command(run, debug=debug)
