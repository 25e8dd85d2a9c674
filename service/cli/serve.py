"""The command that runs the service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from service.cli.command import run_command
from simplifier.cli.plugin import Debug, print_line


def serve(
    host: Annotated[
        str | None,
        typer.Option(help="Address to listen on.", show_default="OCCLUDER_HOST or 127.0.0.1"),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            help="Port to listen on; 0 takes a free one.", show_default="OCCLUDER_PORT or 8000"
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the database, the blobs and work under way.",
            show_default="OCCLUDER_DATA or occluder_data",
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Serve occluders by HTTP: post a mesh and get triangles back.

    Everything else is set by variables, OCCLUDER_WORKERS and so on: see docs/service.md.

    Ctrl-C (or SIGTERM) finishes the requests under way and gives running jobs back, to be done
    after the next start; once more ends the server at once.
    """

    def run() -> int:
        # Here, not above: 'occluder serve --help' need not have a server installed.
        from service.cli.server import run_server
        from service.settings import read_settings, unknown_settings

        settings = read_settings({"host": host, "port": port, "data": data})
        for line in unknown_settings():
            print_line(f"warning: {line}")
        run_server(settings)
        return 0

    run_command(run, debug=debug)
