"""Jobs spread over processes that may die.

Started by spawn, since a fork after OpenMP has run kills the process.  A worker that dies costs one
attempt of the job that it was at and nothing else: the job is given to a fresh one, once.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from simplifier.errors import BackendUnavailableError, OccluderError
from simplifier.kernels.threads import running
from simplifier.matrix_threads import ONE_THREAD
from simplifier.progress import Cancel

ATTEMPTS = 2
"""Workers that a job may cost."""

DIED = "the process that made it died, twice"
"""Why there is no answer to such a job."""

_GLANCE = 0.05  # seconds between looks at whether to stop


@dataclass(frozen=True)
class JobOutcome:
    """What came of the job at a place."""

    job: int
    answer: Answer


def run_jobs_here(
    work: JobFunction, jobs: Sequence[Any], threads: int, cancel: Cancel | None = None
) -> Iterator[JobOutcome]:
    """As :func:`run_jobs`, in threads of this process and in order; work may look at ``cancel``.

    Where ``cancel`` is set, or the caller closes the iterator, this waits for what is under way.
    """

    def attempted(job: Any) -> Answer:
        with running():
            return answer_of(work, job)

    with ThreadPoolExecutor(threads) as pool:
        attempts = [pool.submit(attempted, job) for job in jobs]
        try:
            for index, attempt in enumerate(attempts):
                answer = attempt.result()
                if cancel is not None and cancel.is_set():
                    return
                yield JobOutcome(index, answer)
        finally:
            pool.shutdown(cancel_futures=True)


def run_jobs(
    start: Start,
    arguments: tuple[Any, ...],
    jobs: Sequence[Any],
    processes: int,
    cancel: Cancel | None = None,
) -> Iterator[JobOutcome]:
    """Do every job in one of some processes; yield each outcome as it comes, in any order.

    ``start(*arguments)`` is called once in each process and returns what does a job.  All of them
    have to be importable and picklable.  When ``cancel`` is set, or the caller closes the iterator,
    the processes are ended and what they are at is lost.

    Raises :class:`BackendUnavailableError` when processes end before they are at any job.
    """
    # Here, not above: a build that has nothing to make needs no numpy.
    from simplifier.kernels.front import LEAST_FACES, load_for

    # Nobody knows here how fine the meshes of the jobs are, and else each process would compile.
    load_for(LEAST_FACES)
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
            with without_interrupts(), _one_thread_each():
                self._workers.append(Worker(self._start, self._arguments))
        for worker in self._workers:
            if self._waiting and worker.idle:
                attempt = self._waiting.popleft()
                worker.give(jobs[attempt.job], attempt)

    def answering(self) -> list[Worker]:
        """Those with something to say; none after a glance's time."""
        ready = wait([one.connection for one in self._workers if not one.idle], _GLANCE)
        return [worker for worker in self._workers if worker.connection in ready]

    def take(self, worker: Worker) -> JobOutcome | None:
        """What a worker says of its job, if it is over."""
        attempt = worker.attempt
        try:
            answer = worker.take()
        except EOFError:
            self._bury(worker)
            answer = Answer(failure=DIED)
            if attempt is not None and attempt.number < ATTEMPTS:
                self._waiting.append(Attempt(attempt.job, attempt.number + 1))
                return None
        else:
            self._stillborn = 0
        return (
            JobOutcome(attempt.job, answer) if attempt is not None and answer is not None else None
        )

    def _bury(self, worker: Worker) -> None:
        self._workers.remove(worker)
        worker.stop()
        worker.join()
        self._stillborn += not worker.ready
        if self._stillborn > ATTEMPTS * self._processes:
            raise BackendUnavailableError(
                "the processes that make occluders die before they begin",
                remedy="call this below \"if __name__ == '__main__':\", or set OCCLUDER_THREADS=1",
            )

    def end(self) -> None:
        for worker in self._workers:
            worker.stop()
        for worker in self._workers:
            worker.join()


JobFunction = Callable[[Any], object]
Start = Callable[..., JobFunction]


@dataclass(frozen=True)
class Answer:
    """What work gave for a job, or in words why it gave nothing."""

    result: Any = None
    failure: str = ""


@dataclass(frozen=True)
class Attempt:
    """The how-manieth try of the job at a place."""

    job: int
    number: int = 1


def answer_of(work: JobFunction, job: Any) -> Answer:
    """Whatever a job raises is its failure."""
    try:
        return Answer(work(job))
    except OccluderError as error:
        return Answer(failure=str(error))
    except MemoryError:
        return Answer(failure="out of memory")
    except Exception as error:  # a fault of this program in one job must not cost the others
        return Answer(failure=f"{type(error).__name__}: {error}")


class Worker:
    """A process started by spawn, and the attempt that it is at; it is idle once it is ready.

    It never hears Ctrl-C, which a terminal sends to all processes: its starter ends it.  It ends by
    itself, whatever it is at, when its starter has died.
    """

    def __init__(self, start: Start, arguments: tuple[Any, ...]) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.attempt: Attempt | None = None
        self.ready = False
        self._process: BaseProcess = context.Process(
            target=_serve, args=(theirs, start, arguments), daemon=True
        )
        self._process.start()
        theirs.close()

    @property
    def idle(self) -> bool:
        return self.ready and self.attempt is None

    def give(self, job: Any, attempt: Attempt) -> None:
        self.attempt = attempt
        with suppress(OSError):  # it has died: taking will tell
            self.connection.send(job)

    def take(self) -> Answer | None:
        """Its next message: None that it is ready, once, then what came of its job.

        Raises EOFError when it has died.
        """
        try:
            answer: Answer | None = self.connection.recv()
        except OSError:
            raise EOFError from None
        self.ready, self.attempt = True, None
        return answer

    def stop(self) -> None:
        """Tell it to end, whatever it is at."""
        self._process.terminate()

    def join(self) -> None:
        """Wait until it has ended."""
        self._process.join()
        self.connection.close()


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Ctrl-C waits until the end of this block, and never comes to processes started within."""
    if not hasattr(signal, "pthread_sigmask"):  # where it is absent they ignore it once they run
        yield
        return
    resource_tracker.ensure_running()  # with the first process it would let Ctrl-C in again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started within multiply matrices in one thread: they share the processors."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(connection: Connection, start: Start, arguments: tuple[Any, ...]) -> None:
    """Do jobs until the other end closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    os.environ["OCCLUDER_THREADS"] = "1"  # the processes share the processors
    work = start(*arguments)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        connection.send(None)
        while True:
            connection.send(answer_of(work, connection.recv()))


def _end_with_starter() -> None:
    """A job may take hours, which nobody would wait for any more."""
    starter = multiprocessing.parent_process()
    if starter is not None:
        starter.join()
        os._exit(1)
