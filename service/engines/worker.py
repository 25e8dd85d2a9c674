"""A worker process: ``python -m service.engines DESCRIPTOR MODULE:FUNCTION``.

The descriptor is its end of a socket pair.  The function gets everything ready and returns what
does a task.  The process lives until the other end closes, and then ends at once, whatever it is
at: nothing outlives its server.
"""

from __future__ import annotations

import gc
import importlib
import logging
import os
import queue
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

from service.engines.confinement import allow_memory, confine, end_group
from service.engines.failures import out_of_memory, program_fault
from service.engines.messages import (
    LARGEST,
    Answer,
    Cancelled,
    Done,
    Failed,
    Ready,
    Task,
    Told,
    answer_bytes,
    order_of,
)
from service.jobs.job import Failure, Summary
from service.jobs.progress import JobProgress

logger = logging.getLogger(__name__)

Tell = Callable[[JobProgress], None]
Cancel = threading.Event
Work = Callable[[Task, Tell, Cancel], Summary]
"""Does a task: writes its files and returns its numbers.

Raises :class:`TaskFailedError` with a reason for the job's owner, :class:`TaskCancelledError` once
the event is set, and whatever else as a fault of the program.
"""
Start = Callable[[], Work]
"""Gets everything ready, once a process."""

_TELL_SECONDS = 0.1


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
                order = order_of(self._connection.recv_bytes(LARGEST))
                if isinstance(order, Task):
                    self.cancel = threading.Event()
                    self._tasks.put(order)
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
        """From the main thread only."""
        try:
            self._connection.send_bytes(answer_bytes(answer))
        except OSError:
            end_group()

    def tell(self, progress: JobProgress) -> None:
        """Some times a second at most: kernels tell far more often than anyone can see.

        What has a picture goes always, as the next one has it no more.
        """
        now = time.monotonic()
        if progress.picture is not None or now - self._told >= _TELL_SECONDS:
            self._told = now
            self.say(Told(progress))


def serve(connection: Connection, start: Start) -> None:
    """Do tasks until the other end closes."""
    wire = _Wire(connection)
    work = start()
    gc.freeze()  # what is loaded stays, and need not be looked through after each task
    wire.say(Ready())
    while True:
        task = wire.next_task()
        wire.say(_answer(work, task, wire))
        gc.collect()  # now, while nobody waits for it


def _answer(work: Work, task: Task, wire: _Wire) -> Answer:
    """Whatever happens is an answer."""
    os.environ["OCCLUDER_THREADS"] = str(task.threads)  # the library reads it at each call
    tempfile.tempdir = task.scratch
    allow_memory(task.memory)
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


def main() -> None:
    """The entry point of the process."""
    confine()
    logging.basicConfig(
        level=logging.INFO, format=f"%(levelname)s worker {os.getpid()}: %(message)s"
    )
    module, _, function = sys.argv[2].partition(":")
    start: Start = getattr(importlib.import_module(module), function)
    serve(Connection(int(sys.argv[1])), start)
