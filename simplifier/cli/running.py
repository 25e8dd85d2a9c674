"""How a command of the command line fails: one line on standard error and an exit status."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Annotated

import typer

from simplifier.cli.console import print_line
from simplifier.cli.interrupts import INTERRUPTED
from simplifier.errors import CancelledError, OccluderError, OptionError

Debug = Annotated[bool, typer.Option("--debug", help="Show the traceback of a failure.")]


def run_guarded(work: Callable[[], object], *, debug: bool) -> None:
    """Turn failures into one line and an exit status."""
    try:
        work()
    except (KeyboardInterrupt, CancelledError):
        _fail("interrupted; nothing was kept", INTERRUPTED, debug=debug)
    except OccluderError as error:
        _fail(str(error), 2 if isinstance(error, OptionError) else 1, debug=debug)
    except MemoryError:
        _fail("out of memory; choose a lower --resolution", 1, debug=debug)
    except BrokenPipeError:  # nobody reads any more: typer ends the run without a word
        raise
    except Exception as error:
        what = f"unexpected {type(error).__name__}: {error}"
        _fail(f"{what}; run it again with --debug and report what it says", 1, debug=debug)


def _fail(message: str, status: int, *, debug: bool) -> None:
    if debug:
        traceback.print_exc()
    print_line(f"error: {message}")
    raise typer.Exit(status)
