"""The machine code of this process's kernels: found, or compiled in processes of their own.

What is compiled is kept (``code_files.py``).
"""

from __future__ import annotations

import importlib
import json
import logging
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from queue import SimpleQueue
from typing import IO

from simplifier.kernels.compiled.code_files import (
    KERNELS,
    find_code,
    kernel_files,
    writable_folder,
)
from simplifier.kernels.compiled.kernel import Kernel
from simplifier.kernels.compiled.loading import load_code
from simplifier.kernels.compiled.processors import Processor
from simplifier.kernels.compiled.waiting import waiting
from simplifier.kernels.threads import thread_count
from simplifier.progress import TellCount, shown_compiling

_PACKAGE = "simplifier.kernels"
_BUILD = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from simplifier.kernels.compiled.compiler.building import main
main(*sys.argv[2:])
"""

_UNCOLORED = {"NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING": "1"}
"""While numba finds types it writes many errors that nobody reads; painting them takes time."""

_log = logging.getLogger(__name__)
_lock = threading.RLock()


class BuildError(Exception):
    """Kernels cannot be compiled ahead; what the process that tried it said is in the text."""


def load_all() -> None:
    """Put the machine code of every kernel file in place, and compile what is missing before.

    Where that cannot be done numba compiles them one by one.
    """
    names = kernel_files()
    for name in names:
        importlib.import_module(f"{_PACKAGE}.{name}")
    for name in load_files([name for name in names if name in waiting]):
        for kernel in _kernels_of(name).values():
            kernel.compile_by_numba()


def load_files(names: Sequence[str]) -> Sequence[str]:
    """Put the machine code of some kernel files in place, and compile what is missing before.

    Together they keep all processors at work.  Where that cannot be done numba compiles each kernel
    when it is called; returns the names of these files.
    """
    with _lock:
        left = [name for name in names if name in waiting]
        missing = [name for name in left if find_code(name) is None]
        try:
            if missing:
                with shown_compiling() as tell:
                    build(missing, tell, writable_folder(), Processor.chosen())
            for name in left:
                _load_file(name)
        except (BuildError, OSError, ValueError, ImportError) as error:
            _log.warning("kernels are compiled one by one, which takes longer: %s", error)
            _settle(left)
            return left
        _settle(left)
        return ()


def _settle(names: Sequence[str]) -> None:
    for name in names:
        waiting.pop(name, None)


def _load_file(name: str) -> None:
    kernels, path = _kernels_of(name), find_code(name)
    if path is None:
        raise BuildError(f"{name} has no machine code")
    code = load_code(path, list(kernels))
    for called, kernel in kernels.items():
        kernel.run_machine_code(code[called])


def _kernels_of(name: str) -> dict[str, Kernel]:
    """The kernels of a file that Python calls, by name."""
    module = sys.modules[f"{_PACKAGE}.{name}"]
    return {
        one.__name__: one
        for one in vars(module).values()
        if isinstance(one, Kernel) and one.takes and one.file == name
    }


def build(names: Sequence[str], tell: TellCount, folder: Path, target: Processor) -> None:
    """Compile kernel files for a processor into a folder, on all that are here.

    ``tell`` hears from this thread how many are done.  Raises :class:`BuildError`.
    """
    # The longest first, so that no process is left with one at the end.
    jobs = sorted(names, key=lambda name: (KERNELS / f"{name}.py").stat().st_size)
    answers: SimpleQueue[str | BuildError] = SimpleQueue()
    with ExitStack() as stack:
        # Not a pipe, which fills up while nobody reads.
        said = stack.enter_context(tempfile.TemporaryFile("w+"))
        for _ in range(min(thread_count(), len(jobs))):
            process = stack.enter_context(_compiler(said, folder, target))
            feeder = threading.Thread(target=_feed, args=(process, jobs, answers, said))
            feeder.start()
            stack.callback(feeder.join)
            stack.callback(process.kill)
        for done in range(len(names)):
            tell(done, len(names))
            answer = answers.get()
            if isinstance(answer, BuildError):
                raise answer
        tell(len(names), len(names))


def _compiler(said: IO[str], folder: Path, target: Processor) -> subprocess.Popen[str]:
    paths = json.dumps([path for path in sys.path if isinstance(path, str)])
    command = [sys.executable, "-c", _BUILD, paths, str(folder)]
    pipe = subprocess.PIPE
    return subprocess.Popen(
        command, stdin=pipe, stdout=pipe, stderr=said, text=True,
        env={**os.environ, **target.variables, **_UNCOLORED},
    )  # fmt: skip


def _feed(
    process: subprocess.Popen[str],
    jobs: list[str],
    answers: SimpleQueue[str | BuildError],
    said: IO[str],
) -> None:
    """Give the process job after job, and pass on what it answers."""
    assert process.stdin is not None
    assert process.stdout is not None
    while True:
        try:
            name = jobs.pop()
        except IndexError:
            return
        answer = ""
        with suppress(OSError):
            process.stdin.write(name + "\n")
            process.stdin.flush()
            answer = process.stdout.readline().strip()
        if answer != name:
            said.seek(0)
            last = said.read().strip().splitlines() or ["the compiler ended"]
            answers.put(BuildError(f"{name}: {last[-1]}"))
            return
        answers.put(name)
