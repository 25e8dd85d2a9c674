"""Jobs spread over processes that may die.

Started by spawn, since a fork after OpenMP has run kills the process.  A worker that dies costs one
attempt of the job that it was at and nothing else: the job is given to a fresh one, once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

from simplifier.errors import BackendUnavailableError
from simplifier.hierarchy.worker import (
    Answer,
    Attempt,
    Start,
    Work,
    Worker,
    answer_of,
    without_interrupts,
)
from simplifier.progress import Cancel

_ATTEMPTS = 2
_GLANCE = 0.05  # seconds between looks at whether to stop


@dataclass(frozen=True)
class Outcome:
    """What came of the job at a place."""

    job: int
    answer: Answer


def run_jobs_here(
    work: Work, jobs: Sequence[Any], threads: int, cancel: Cancel | None = None
) -> Iterator[Outcome]:
    """As :func:`run_jobs`, in threads of this process and in order; work may look at ``cancel``.

    Where ``cancel`` is set, or the caller closes the iterator, this waits for what is under way.
    """
    with ThreadPoolExecutor(threads) as pool:
        attempts = [pool.submit(answer_of, work, job) for job in jobs]
        try:
            for index, attempt in enumerate(attempts):
                answer = attempt.result()
                if cancel is not None and cancel.is_set():
                    return
                yield Outcome(index, answer)
        finally:
            pool.shutdown(cancel_futures=True)


def run_jobs(
    start: Start,
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    processes: int,
    cancel: Cancel | None = None,
) -> Iterator[Outcome]:
    """Do every job in one of some processes; yield each outcome as it comes, in any order.

    ``start(*arguments)`` is called once in each process and returns what does a job.  All of them
    have to be importable and picklable.  When ``cancel`` is set, or the caller closes the iterator,
    the processes are ended and what they are at is lost.

    Raises :class:`~simplifier.errors.OutputError` when a job does, and
    :class:`BackendUnavailableError` when processes end before they are at any job.
    """
    crew = _Crew(start, arguments, processes, deque(Attempt(job) for job in range(len(jobs))))
    try:
        while crew.at_work:
            if cancel is not None and cancel.is_set():
                return
            crew.fill(jobs)
            for worker in crew.answering():
                outcome = crew.take(worker)
                if outcome is not None:
                    yield outcome
    finally:
        crew.end()


class _Crew:
    """The processes, and the attempts that wait for one."""

    def __init__(
        self, start: Start, arguments: tuple[Any, ...], processes: int, waiting: deque[Attempt]
    ) -> None:
        self._start, self._arguments, self._processes = start, arguments, processes
        self._waiting = waiting
        self._workers: list[Worker] = []
        self._stillborn = 0  # processes in a row that died before they were ready

    @property
    def at_work(self) -> bool:
        return bool(self._waiting) or any(worker.attempt for worker in self._workers)

    def fill(self, jobs: Sequence[Any]) -> None:
        """Start what processes are missing and give a job to each that has none."""
        while self._waiting and len(self._workers) < self._processes:
            with without_interrupts():
                self._workers.append(Worker(self._start, self._arguments))
        for worker in self._workers:
            if self._waiting and worker.idle:
                attempt = self._waiting.popleft()
                worker.give(jobs[attempt.job], attempt)

    def answering(self) -> list[Worker]:
        """Those with something to say; none after a glance's time."""
        ready = wait([one.connection for one in self._workers if not one.idle], _GLANCE)
        return [worker for worker in self._workers if worker.connection in ready]

    def take(self, worker: Worker) -> Outcome | None:
        """What a worker says of its job, if it is over."""
        attempt = worker.attempt
        try:
            answer = worker.take()
        except EOFError:
            self._bury(worker)
            answer = Answer(failure="the process that made it died, twice")
            if attempt is not None and attempt.number < _ATTEMPTS:
                self._waiting.append(Attempt(attempt.job, attempt.number + 1))
                return None
        else:
            self._stillborn = 0
        return Outcome(attempt.job, answer) if attempt is not None and answer is not None else None

    def _bury(self, worker: Worker) -> None:
        self._workers.remove(worker)
        worker.stop()
        worker.join()
        self._stillborn += not worker.ready
        if self._stillborn > _ATTEMPTS * self._processes:
            raise BackendUnavailableError(
                "the processes that make occluders die before they begin",
                remedy="call this below \"if __name__ == '__main__':\", or set OCCLUDER_THREADS=1",
            )

    def end(self) -> None:
        for worker in self._workers:
            worker.stop()
        for worker in self._workers:
            worker.join()
