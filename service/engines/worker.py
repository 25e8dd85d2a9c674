"""A worker process: ``python -m service.engines DESCRIPTOR MODULE:FUNCTION``.

The descriptor is its end of a socket pair.  The function gets everything ready and returns what
does a task.  The process lives until the other end closes, and then ends at once, whatever it is
at: nothing outlives its server.

Before it reads anything it confines itself (:mod:`service.engines.confinement`).  The server sees
to the rest: it starts the process in a group of its own, so that one signal ends all that it
starts, with little of its own environment, and watches its memory and its time.
"""

from __future__ import annotations

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
from types import FrameType, TracebackType
from typing import Self

from service.engines.confinement import confine
from service.engines.failures import out_of_memory, out_of_reading_time, program_fault
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
from service.jobs.progress import READING, JobProgress
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


class TaskFailedError(Exception):
    """The task has no result, and would have none if it were done again."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(failure.detail)
        self.failure = failure


class TaskCancelledError(Exception):
    """The task was told to end."""


class ReadingTimeError(BaseException):
    """Reading takes too long.  No Exception: readers turn those into words on the file."""


class ReadingLimit:
    """Ends reading after some seconds, by a signal that raises :class:`ReadingTimeError`.

    It ends what Python runs, and leaves the process as good as before.  A call that never comes
    back to Python does not hear of it; then the server ends the process, a moment later.
    """

    def __init__(self, seconds: float | None, tell: ReportProgress) -> None:
        """``tell`` is told all progress, by which the limit knows what is read when."""
        self.passed = False
        # Signals are for the main thread alone, which is where tasks are done.
        here = threading.current_thread() is threading.main_thread()
        self._seconds, self._tell = seconds if here else None, tell
        self._reading = False

    def tell(self, progress: JobProgress) -> None:
        reading = progress.stage == READING
        if self._seconds is not None and reading != self._reading:
            self._reading = reading
            signal.setitimer(signal.ITIMER_REAL, self._seconds if reading else 0.0)
        self._tell(progress)

    def __enter__(self) -> Self:
        if self._seconds is not None:
            signal.signal(signal.SIGALRM, self._raise)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._seconds is not None:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, signal.SIG_IGN)

    def _raise(self, number: int, frame: FrameType | None) -> None:
        self.passed = True
        raise ReadingTimeError


class _Wire:
    """This end of the pair: a thread reads it, and whoever has something to say writes to it."""

    def __init__(self, connection: Connection) -> None:
        self._tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
        self.cancel = threading.Event()
        self._connection = connection
        self._told, self._stage = float("-inf"), ""
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
        self._told, self._stage = float("-inf"), ""
        return task

    def say(self, answer: Answer) -> None:
        """Send an answer; from the main thread only."""
        try:
            self._connection.send_bytes(answer_bytes(answer))
        except OSError:
            end_group()

    def tell(self, progress: JobProgress) -> None:
        """Send progress some times a second at most: kernels report more often than anyone can see.

        What has a picture goes always, as the next one has it no more; and so do begin and
        end of reading, on which the server has a limit.
        """
        now = time.monotonic()
        turns = (self._stage == READING) != (progress.stage == READING)
        if turns or progress.picture is not None or now - self._told >= _TELL_SECONDS:
            self._told, self._stage = now, progress.stage
            self.say(TaskProgress(progress))


def serve(connection: Connection, start: LoadWork, unconfined: tuple[str, ...] = ()) -> None:
    """Do tasks until the other end closes; ``unconfined`` is told at the first word."""
    wire = _Wire(connection)
    work = start()
    gc.freeze()  # what is loaded stays, and need not be looked through after each task
    wire.say(Ready(unconfined))
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
    threads = threading.active_count()
    damaged = tuple(name for name in task.digests if not _is_right(task, name))
    if damaged:
        return Damaged(damaged)
    limit = ReadingLimit(task.reading, wire.tell)
    answer: Answer | None = None
    with suppress(ReadingTimeError), limit:
        answer = _try(work, task, limit.tell, wire.cancel)
    if answer is None or (limit.passed and not isinstance(answer, Done)):
        # Whatever has become of the error on its way.
        left_behind = threading.active_count() > threads
        return Failed(out_of_reading_time(task.reading or 0.0), odd=left_behind)
    return answer


def _try(work: DoTask, task: Task, tell: ReportProgress, cancel: Cancel) -> Answer:
    try:
        return Done(work(task, tell, cancel))
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
    unconfined = confine()
    form = os.environ.get("OCCLUDER_LOG", LogForm.TEXT).lower()
    log_as(
        LogForm(form) if form in set(LogForm) else LogForm.TEXT,
        text=f"%(levelname)s worker {os.getpid()}: %(message)s",
    )
    logging.getLogger().setLevel(logging.INFO)
    module, _, function = sys.argv[2].partition(":")
    start: LoadWork = getattr(importlib.import_module(module), function)
    serve(Connection(int(sys.argv[1])), start, unconfined)


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
