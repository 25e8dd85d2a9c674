"""Jobs spread over processes that may die.

Started by spawn, since a fork after OpenMP has run kills the process.  A worker that dies costs one
attempt of the job that it was at and nothing else: the job is given to a fresh one, once.
"""

from __future__ import annotations

import multiprocessing
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from simplifier.errors import OccluderError
from simplifier.progress import Cancel

_ATTEMPTS = 2
_GLANCE = 0.05  # seconds between looks at whether to stop


@dataclass(frozen=True)
class Outcome:
    """What a job gave, or why it gave nothing."""

    job: int
    result: Any = None
    failure: str = ""


def run_jobs(
    start: Callable[..., Callable[[Any], object]],
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    processes: int,
    cancel: Cancel | None = None,
) -> Iterator[Outcome]:
    """Do every job in one of some processes; yield each outcome as it comes, in any order.

    ``start(*arguments)`` is called once in each process and returns what does a job.  All of them
    have to be importable and picklable.  When ``cancel`` is set, or the caller ends the iteration,
    the processes are ended and what they are at is lost.
    """
    waiting = deque((index, 1) for index in range(len(jobs)))
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.busy for worker in workers):
            if cancel is not None and cancel.is_set():
                return
            while waiting and len(workers) < processes:
                workers.append(_Worker(start, arguments))
            for worker in workers:
                if waiting and not worker.busy:
                    worker.give(jobs, *waiting.popleft())
            ready = wait([worker.connection for worker in workers if worker.busy], _GLANCE)
            for worker in [worker for worker in workers if worker.connection in ready]:
                outcome = worker.take()
                if outcome is not None:
                    yield outcome
                    continue
                index, attempt = worker.job
                worker.end()
                workers.remove(worker)
                if attempt < _ATTEMPTS:
                    waiting.append((index, attempt + 1))
                else:
                    yield Outcome(index, failure="the process that made it died, twice")
    finally:
        for worker in workers:
            worker.end()


class _Worker:
    """One process and the job that it is at."""

    def __init__(
        self, start: Callable[..., Callable[[Any], object]], arguments: tuple[Any, ...]
    ) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.job = (0, 0)
        self.busy = False
        self._process: BaseProcess = context.Process(
            target=_serve, args=(theirs, start, arguments), daemon=True
        )
        self._process.start()
        theirs.close()

    def give(self, jobs: Sequence[Any], index: int, attempt: int) -> None:
        self.job, self.busy = (index, attempt), True
        with suppress(OSError):  # it has died: taking will tell
            self.connection.send((index, jobs[index]))

    def take(self) -> Outcome | None:
        """What came of the job; None when the process has died."""
        try:
            outcome: Outcome = self.connection.recv()
        except (EOFError, OSError):
            return None
        self.busy = False
        return outcome

    def end(self) -> None:
        self._process.terminate()
        self._process.join()
        self.connection.close()


def _serve(
    connection: Connection,
    start: Callable[..., Callable[[Any], object]],
    arguments: tuple[Any, ...],
) -> None:
    """Do jobs until the other end closes."""
    os.environ["OCCLUDER_THREADS"] = "1"  # the processes share the processors
    with suppress(EOFError, KeyboardInterrupt, BrokenPipeError):
        work = start(*arguments)
        while True:
            index, job = connection.recv()
            connection.send(_outcome(work, index, job))


def _outcome(work: Callable[[Any], object], index: int, job: Any) -> Outcome:
    try:
        return Outcome(index, work(job))
    except OccluderError as error:
        return Outcome(index, failure=str(error))
    except MemoryError:
        return Outcome(index, failure="out of memory")
