"""How a command of the command line fails: one line on standard error and an exit status.

Ctrl-C on the command line: the first ends the work, the second the process, at once.

The main thread hears of it between kernels, so within some milliseconds, or the time that a kernel
compiles for.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Annotated

import typer

from simplifier.cli.console import Printed, print_line, printing
from simplifier.cli.help import ADVANCED, OUTPUT
from simplifier.errors import CancelledError, OccluderError, OptionError

Debug = Annotated[
    bool,
    typer.Option("--debug", help="Show the traceback of a failure.", rich_help_panel=ADVANCED),
]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", help="Print nothing but warnings and errors.", rich_help_panel=OUTPUT
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json", help="Print the figures on standard output as JSON.", rich_help_panel=OUTPUT
    ),
]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose", "-v", help="Print the time of every stage, too.", rich_help_panel=OUTPUT
    ),
]


def run_guarded(
    work: Callable[[], object], *, debug: bool, quiet: bool = False, as_json: bool = False
) -> None:
    """Turn failures into one line and an exit status.

    ``quiet``    nothing is printed but warnings and errors.
    ``as_json``  on standard output nothing is printed but by ``print_json``.
    """
    try:
        with printing(Printed.of(quiet, as_json)):
            work()
    except (KeyboardInterrupt, CancelledError):
        _fail("interrupted; nothing was kept", INTERRUPTED, debug=debug)
    except OccluderError as error:
        _fail(str(error), 2 if isinstance(error, OptionError) else 1, debug=debug)
    except MemoryError:
        _fail("out of memory; choose a lower --resolution", 1, debug=debug)
    except (typer.Exit, BrokenPipeError):  # has been told; nobody reads any more
        raise
    except Exception as error:
        _fail(_unexpected(error), 1, debug=debug)


def _unexpected(error: Exception) -> str:
    """What to say of an error that the program has no class for."""
    if isinstance(error, OSError) and error.filename is None and error.errno == errno.ENOSPC:
        return (
            "standard output cannot be written, since its disk is full; files that were made are"
            " kept"
        )
    if isinstance(error, RuntimeError) and str(error) == _NO_THREAD:
        return (
            "no thread can be started: memory or threads are limited; raise the limit (ulimit -v,"
            " ulimit -u), or set OCCLUDER_THREADS to 1"
        )
    what = f"unexpected {type(error).__name__}: {error}"
    return f"{what}; run it again with --debug and report what it says"


_NO_THREAD = "can't start new thread"  # as Python words it, which has no class for it


def _fail(message: str, status: int, *, debug: bool) -> None:
    if debug:
        traceback.print_exc()
    print_line(f"error: {message}")
    raise typer.Exit(status)


INTERRUPTED = 130
"""Exit status, by the custom of shells."""


class Interrupts:
    """What Ctrl-C does.  The first raises KeyboardInterrupt, except in the blocks below."""

    def __init__(self) -> None:
        self._cancel = threading.Event()
        self._heard = 0
        self._deferring = self._holding = False

    @property
    def heard(self) -> bool:
        """Whether there was one."""
        return self._heard > 0

    @contextmanager
    def deferred(self) -> Iterator[threading.Event]:
        """Work that can be cancelled: the first sets the event in place of raising."""
        self._deferring = True
        try:
            yield self._cancel
        finally:
            self._deferring = False

    @contextmanager
    def held(self) -> Iterator[None]:
        """Short work that is not to be broken off: all wait until its end."""
        self._holding = True
        try:
            yield
        finally:
            self._holding = False
            if self._heard > 1:
                _quit()

    def hear(self, number: int, frame: FrameType | None) -> None:
        """The handler of the signal."""
        self._heard += 1
        self._cancel.set()
        if self._holding:
            return
        if self._heard > 1:
            _quit()
        if not self._deferring:
            raise KeyboardInterrupt


@contextmanager
def interrupts() -> Iterator[Interrupts]:
    """Listen to Ctrl-C; outside of the main thread, where that cannot be, nothing is heard."""
    listening = Interrupts()
    if threading.current_thread() is not threading.main_thread():
        yield listening
        return
    before = signal.signal(signal.SIGINT, listening.hear)
    try:
        yield listening
    finally:
        signal.signal(signal.SIGINT, before)


def _quit() -> None:
    """End the process here, whatever other threads do; a progress bar may have hid the cursor."""
    with suppress(OSError, ValueError):  # nobody reads any more, or it is closed
        if sys.stderr.isatty():
            os.write(2, b"\r\x1b[2K\x1b[?25h")
        os.write(2, b"error: interrupted twice; ended at once\n")
    os._exit(INTERRUPTED)
