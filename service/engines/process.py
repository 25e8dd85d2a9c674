"""The server's end of a worker process.

A plain child by ``subprocess`` rather than ``multiprocessing``: it gets an environment of its own
before any library reads it, runs none of the server's main module, and inherits nothing but one
socket.  It is started by a process that hides its memory.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path

from service.engines.confinement import hide_memory
from service.engines.environment import worker_environment
from service.engines.messages import (
    LARGEST,
    Answer,
    CancelTask,
    Instruction,
    Ready,
    Task,
    answer_of,
    instruction_bytes,
)

logger = logging.getLogger(__name__)

_PAGE = os.sysconf("SC_PAGE_SIZE")


class ProcessDiedError(Exception):
    """A worker process is gone, or talked nonsense; the message goes on after "its process"."""


class WorkerProcess:
    """A process that does one task at a time.  For one thread, which has to outlive it."""

    def __init__(self, work: str) -> None:
        """``work``, as ``MODULE:FUNCTION``, is called in the process and returns what does tasks.

        Raises OSError when no process can be started.
        """
        hide_memory()
        ours, theirs = socket.socketpair()
        with ours, theirs:
            self._process = subprocess.Popen(
                [
                    sys.executable, "-P", "-m", "service.engines",
                    str(theirs.fileno()), work,
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                process_group=0,
                env=worker_environment(os.environ, os.pathsep.join(_import_path())),
            )  # fmt: skip
            self._connection = Connection(ours.detach())
        self.ready = False
        self.tasks = 0
        self._base = 0

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Neither dead nor stopped by a signal.

        Leaves a dead one unreaped, so that its number cannot become another process's.
        """
        look = os.WEXITED | os.WSTOPPED | os.WNOHANG | os.WNOWAIT
        return self._process.returncode is None and os.waitid(os.P_PID, self.pid, look) is None

    @property
    def grown(self) -> int:
        """Bytes of private memory that it has beside what it had when it was ready.

        Those of the processes that it has started count as well.  0 where there is no ``/proc``.
        """
        return sum(map(_private_bytes, _tree(self.pid))) - self._base

    @property
    def processor_seconds(self) -> float | None:
        """Processor time that it and those that it has started have taken.

        It may fall when one of these ends.  None where the system does not tell.
        """
        try:
            return sum(map(_processor_seconds, _tree(self.pid)))
        except OSError:
            return None  # one has ended since it was listed: that is life as well

    def send(self, instruction: Instruction) -> None:
        """What a dead process is told is lost: receiving says that it is dead."""
        self.tasks += isinstance(instruction, Task)
        with suppress(OSError):
            self._connection.send_bytes(instruction_bytes(instruction))

    def cancel(self) -> None:
        """Ask it to end its task."""
        self.send(CancelTask())

    def receive(self, seconds: float) -> Answer | None:
        """Its next message; None where there is none in that time.

        Raises :class:`ProcessDiedError`.
        """
        try:
            if not self._connection.poll(seconds):
                return None
            answer = answer_of(self._connection.recv_bytes(LARGEST))
        except (EOFError, OSError, ValueError):
            self.kill()
            raise ProcessDiedError(_ending(self._process.returncode)) from None
        if isinstance(answer, Ready):
            self.ready = True
            self._base = _private_bytes(self.pid)
            if answer.unconfined:
                _tell_unconfined(answer.unconfined)
        return answer

    def kill(self) -> None:
        """End it and all that it has started, now; how it ended by itself is kept."""
        if self._process.returncode is None:
            with suppress(ProcessLookupError, PermissionError):  # macOS forbids it for the dead
                os.killpg(self.pid, signal.SIGKILL)
            self._process.wait()
        self._connection.close()


@cache
def _tell_unconfined(ways: tuple[str, ...]) -> None:
    """In the log, once: it is the same for all."""
    logger.warning(
        "worker processes, which read files from anyone, can %s: this system has no way to keep "
        "them from it (docs/security.md)", " and ".join(ways),
    )  # fmt: skip


def _import_path() -> Iterator[str]:
    """The folders in which this process finds modules, for the other to find the same ones."""
    for entry in sys.path:
        yield str(Path(entry).resolve())


def _ending(status: int) -> str:
    if status >= 0:
        return f"ended with exit status {status}"
    try:
        return f"was ended by signal {-status} ({signal.Signals(-status).name})"
    except ValueError:
        return f"was ended by signal {-status}"


def _tree(pid: int) -> Iterator[int]:
    """A process and those that its main thread, and theirs, have started."""
    yield pid
    with suppress(OSError):
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            yield from _tree(int(child))


def _private_bytes(pid: int) -> int:
    """Resident memory that is backed by no file."""
    try:
        fields = Path(f"/proc/{pid}/statm").read_text().split()
    except OSError:
        return 0
    return (int(fields[1]) - int(fields[2])) * _PAGE


def _processor_seconds(pid: int) -> float:
    """Processor time of all threads of a process; raises OSError where nothing tells."""
    if sys.platform != "linux":
        raise OSError
    # The clock of another process: the kernel's own form of its id, for which Python has no call
    # (https://man7.org/linux/man-pages/man3/clock_getcpuclockid.3.html).
    return time.clock_gettime(~pid << 3 | 2)
