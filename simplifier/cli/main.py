"""The command line: ``occluder``.

Exit status: 0 done, 1 the input or the run failed, 2 wrong usage, 130 interrupted with nothing
kept.  A failure is one line on standard error that says what, where and what to do; ``--debug``
adds the traceback.
"""

from __future__ import annotations

import atexit
import gc
import signal
import sys
from typing import Annotated, Any

import typer

from simplifier.cli.commands import Commands
from simplifier.cli.console import accept_any_text, print_line
from simplifier.cli.interrupts import INTERRUPTED
from simplifier.version import VERSION

app = typer.Typer(
    cls=Commands, add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(VERSION)
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Make occluders: a handful of triangles that hide nearly what a mesh hides."""


_UsageError: Any = typer.BadParameter.__bases__[0]
"""Wrong usage in general: click's class, or that of the copy that newer typers bring along."""


_OBJECTS_BETWEEN_COLLECTIONS = 200_000


def main() -> None:
    """The entry point of the ``occluder`` command."""
    accept_any_text()
    # Large scenes are a million small objects, none of them garbage: looking through them again
    # and again took a sixth of a build in which nothing had changed.
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)  # all is done by then
    try:
        status = app(standalone_mode=False)
    except (typer.Abort, KeyboardInterrupt):  # Ctrl-C before the command has begun
        print_line("error: interrupted; nothing was kept")
        status = INTERRUPTED
    except _UsageError as error:
        message = error.format_message().rstrip(".")
        if message:  # else the help has been shown, for want of arguments
            command = error.ctx.command_path if error.ctx else "occluder"
            print_line(f"error: {message}; see '{command} --help'")
        status = error.exit_code
    sys.exit(status)
