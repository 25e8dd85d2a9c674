"""A process that tries cases one by one, and is ended when one takes too long.

It may take only so much memory, so a case that asks for more fails like any other, and a kernel
that reads past its arrays takes nothing with it.
"""

from __future__ import annotations

import contextlib
import os
import re
import resource
import shutil
import signal
import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.corpus import kept_inputs
from tests.fuzz.lines import Line, recorded
from tests.fuzz.targets import Target, target_named

_SPAWN = get_context("spawn")
_START_SECONDS = 300.0  # a first start compiles kernels
_MORE_MEMORY = 3 << 30  # bytes of address space beyond what a process begins with
_HERE = Path(__file__).parents[2]
_NUMBER = re.compile(r"[-+]?\d[\d.e+-]*|\binf\b|\bnan\b")


Find = Callable[[str], Target]
"""From a name to the target: a function of some module."""


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    ``verdict``  ``taken``, or the kind of refusal; empty where there is a fault.
    ``fault``    what went wrong and in which function: the same for the same bug, about.
    ``trace``    the whole traceback of it.
    ``lines``    of the library, that no case of this process has reached before.
    """

    verdict: str = ""
    fault: str = ""
    trace: str = ""
    lines: frozenset[Line] = field(default_factory=frozenset)


class Watched:
    """``with Watched() as watched: watched.tried("ply", data)``, for one thread."""

    def __init__(self, *, warm: str = "", records: bool = False, find: Find = target_named) -> None:
        """``warm``: a target whose kernels are there before the clock runs; ``records`` lines.

        ``find`` goes to the process by its name.
        """
        self._arguments = warm, records, find
        self._find = find
        self._process: _Child | None = None

    def __enter__(self) -> Watched:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process:
            self._process.end()

    def tried(self, target: str, data: bytes) -> Outcome:
        """Never raises for what the case does."""
        if self._process is None:
            self._process = _Child(*self._arguments)
        seconds = self._find(target).seconds
        outcome = self._process.tried(target, data, seconds)
        if outcome is None:
            fault = self._process.end()
            self._process = None
            outcome = Outcome(fault=fault or f"takes more than {seconds:g} s")
        return outcome


class _Child:
    def __init__(self, *arguments: object) -> None:
        self._pipe, theirs = _SPAWN.Pipe()
        self._folder = tempfile.mkdtemp(prefix="occluder-fuzz-")
        self._process = _SPAWN.Process(
            target=_serve, args=(theirs, Path(self._folder), *arguments), daemon=True
        )
        self._process.start()
        theirs.close()
        if not self._pipe.poll(_START_SECONDS) or self._pipe.recv() != "ready":
            raise RuntimeError("the process that tries cases does not start")

    def tried(self, target: str, data: bytes, seconds: float) -> Outcome | None:
        """None where it takes too long, or the process has died of it."""
        with contextlib.suppress(EOFError, ConnectionError):
            self._pipe.send((target, data))
            if self._pipe.poll(seconds):
                outcome = self._pipe.recv()
                assert isinstance(outcome, Outcome)
                return outcome
        return None

    def end(self) -> str:
        """End the process; what it died of, if it was dead already."""
        self._pipe.close()
        self._process.join(0.5)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        shutil.rmtree(self._folder, ignore_errors=True)
        if code is not None and code < 0:
            return f"the process dies of {signal.Signals(-code).name}"
        return "" if code in (None, 0) else f"the process ends with {code}"


def _serve(pipe: Connection, folder: Path, warm: str, records: bool, find: Find) -> None:
    """In the child: until the pipe is closed."""
    os.environ["OCCLUDER_THREADS"] = "1"  # scenes are built here, and nothing else takes turns
    if warm:
        _warm_up(find(warm), folder)
    limit_memory()
    pipe.send("ready")
    known: set[Line] = set()
    with contextlib.suppress(EOFError, KeyboardInterrupt):
        while True:
            name, data = pipe.recv()
            pipe.send(_outcome(find(name), data, folder, known if records else None))


def _warm_up(target: Target, folder: Path) -> None:
    for path in kept_inputs(target.name):
        with contextlib.suppress(Exception):
            target.verdict(path.read_bytes(), folder)


def limit_memory() -> None:
    """So much more than is taken now; what asks for more gets a MemoryError."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + _MORE_MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _outcome(target: Target, data: bytes, folder: Path, known: set[Line] | None) -> Outcome:
    reached: set[Line] = set()
    recording = contextlib.nullcontext() if known is None else recorded(reached)
    try:
        with recording:
            verdict = target.verdict(data, folder)
    except Exception as error:
        return Outcome(fault=fault_of(error), trace=traceback.format_exc())
    if known is None:
        return Outcome(verdict)
    lines = frozenset(reached - known)
    known |= lines
    return Outcome(verdict, lines=lines)


def fault_of(error: Exception) -> str:
    """Its kind, and the last function of this repository that it came through."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).is_relative_to(_HERE) and ".venv" not in frame.filename
    ]
    place = ""
    if frames:
        place = f" in {Path(frames[-1].filename).relative_to(_HERE)}: {frames[-1].name}"
    words = f" ({error})" if isinstance(error, AssertionError) else ""
    return type(error).__name__ + place + _NUMBER.sub("#", words)
