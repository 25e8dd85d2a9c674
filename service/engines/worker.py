"""A worker process: ``python -m service.engines DESCRIPTOR MODULE:FUNCTION``.

The descriptor is its end of a socket pair.  The function gets everything ready and returns what
does a task.  The process lives until the other end closes, and then ends at once, whatever it is
at: nothing outlives its server.

Before it reads anything it sets by itself what it may do to the machine.  The server sees to the
rest: it starts the process in a group of its own, so that one signal ends all that it starts, and
watches its memory and its time.
"""

from __future__ import annotations

import ctypes
import gc
import hashlib
import importlib
import logging
import os
import queue
import resource
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from service.engines.failures import out_of_memory, program_fault
from service.engines.messages import (
    LARGEST,
    Answer,
    Cancelled,
    Damaged,
    Done,
    Failed,
    Ready,
    Task,
    TaskProgress,
    answer_bytes,
    instruction_of,
)
from service.jobs.job import Failure, Summary
from service.jobs.progress import JobProgress
from service.logs import LogForm, log_as, serving_request

logger = logging.getLogger(__name__)

ReportProgress = Callable[[JobProgress], None]
Cancel = threading.Event
DoTask = Callable[[Task, ReportProgress, Cancel], Summary]
"""Does a task: writes its files and returns its numbers.

Raises :class:`TaskFailedError` with a reason for the job's owner, :class:`TaskCancelledError` once
the event is set, and whatever else as a fault of the program.
"""
LoadWork = Callable[[], DoTask]
"""Gets everything ready, once a process."""

_TELL_SECONDS = 0.1

_NICE = 5
_PR_SET_PDEATHSIG = 1
_OOM_SCORE = "500"


class TaskFailedError(Exception):
    """The task has no result, and would have none if it were done again."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.detail)
        self.failure = failure


class TaskCancelledError(Exception):
    """The task was told to end."""


class _Wire:
    """This end of the pair: a thread reads it, and whoever has something to say writes to it."""

    def __init__(self, connection: Connection) -> None:
        self._tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
        self.cancel = threading.Event()
        self._connection = connection
        self._told = float("-inf")
        threading.Thread(target=self._read, name="orders", daemon=True).start()

    def _read(self) -> None:
        try:
            while True:
                instruction = instruction_of(self._connection.recv_bytes(LARGEST))
                if isinstance(instruction, Task):
                    self.cancel = threading.Event()
                    self._tasks.put(instruction)
                else:
                    self.cancel.set()
        except (EOFError, OSError):
            end_group()  # the server is gone, or wants this process gone

    def next_task(self) -> Task:
        """Waits for it; the first that it tells goes at once, however late the last one spoke."""
        task = self._tasks.get()
        self._told = float("-inf")
        return task

    def say(self, answer: Answer) -> None:
        """Send an answer; from the main thread only."""
        try:
            self._connection.send_bytes(answer_bytes(answer))
        except OSError:
            end_group()

    def tell(self, progress: JobProgress) -> None:
        """Send progress some times a second at most: kernels report more often than anyone can see.

        What has a picture goes always, as the next one has it no more.
        """
        now = time.monotonic()
        if progress.picture is not None or now - self._told >= _TELL_SECONDS:
            self._told = now
            self.say(TaskProgress(progress))


def serve(connection: Connection, start: LoadWork) -> None:
    """Do tasks until the other end closes."""
    wire = _Wire(connection)
    work = start()
    gc.freeze()  # what is loaded stays, and need not be looked through after each task
    wire.say(Ready())
    while True:
        task = wire.next_task()
        with serving_request(task.request_id):
            answer = _answer(work, task, wire)
        wire.say(answer)
        gc.collect()  # now, while nobody waits for it


def _answer(work: DoTask, task: Task, wire: _Wire) -> Answer:
    """Do a task; whatever happens is an answer."""
    os.environ["OCCLUDER_THREADS"] = str(task.threads)  # the library reads it at each call
    tempfile.tempdir = task.scratch
    allow_memory(task.memory)
    damaged = tuple(name for name in task.digests if not _is_right(task, name))
    if damaged:
        return Damaged(damaged)
    try:
        return Done(work(task, wire.tell, wire.cancel))
    except TaskFailedError as error:
        return Failed(error.failure, odd=False)
    except TaskCancelledError:
        return Cancelled()
    except MemoryError:
        return Failed(out_of_memory(task.memory), odd=True)
    except Exception as error:
        logger.exception("a task failed by a fault of the program")
        return Failed(program_fault(error), odd=True)


def _is_right(task: Task, name: str) -> bool:
    """Whether an input has the bytes that were sent; the work then finds them in memory."""
    try:
        with Path(task.inputs[name]).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest() == task.digests[name]
    except OSError:  # the disk itself tells that it cannot read it
        return False


def main() -> None:
    """The entry point of the process."""
    confine()
    form = os.environ.get("OCCLUDER_LOG", LogForm.TEXT).lower()
    log_as(
        LogForm(form) if form in set(LogForm) else LogForm.TEXT,
        text=f"%(levelname)s worker {os.getpid()}: %(message)s",
    )
    logging.getLogger().setLevel(logging.INFO)
    module, _, function = sys.argv[2].partition(":")
    start: LoadWork = getattr(importlib.import_module(module), function)
    serve(Connection(int(sys.argv[1])), start)


def confine() -> None:
    """Yield to the server, write files that nobody else can read, leave no core, die with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, which ends its own
    os.umask(0o077)
    os.nice(_NICE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform == "linux":
        # The signal comes when the thread that started this process ends, even by kill -9, and
        # even while a kernel keeps every thread here from running.
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        # When memory runs out on the machine, workers go before the server does.
        with suppress(OSError):  # a container may show /proc without letting anyone write to it
            Path("/proc/self/oom_score_adj").write_text(_OOM_SCORE)


def allow_memory(more: int) -> None:
    """Let this process take so many bytes beside what it has; beyond is a MemoryError.

    RLIMIT_DATA counts private writable memory.  RLIMIT_AS would count what is only reserved as
    well, several hundred megabytes for a handful of threads.
    """
    if sys.platform != "linux":
        return
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    wanted = _data_bytes() + more
    soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _data_bytes() -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0


def end_group() -> None:
    """End this process and all that it has started, at once."""
    try:
        if os.getpgrp() == os.getpid():
            os.killpg(0, signal.SIGKILL)
    finally:
        os._exit(1)
