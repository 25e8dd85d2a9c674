"""One process that does jobs, and may die at any of them."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from simplifier.errors import OccluderError, OutputError

Work = Callable[[Any], object]
Start = Callable[..., Work]


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


def answer_of(work: Work, job: Any) -> Answer:
    """Whatever a job raises is its failure; only a full or forbidden disk is that of all.

    Raises :class:`OutputError`.
    """
    try:
        return Answer(work(job))
    except OutputError:
        raise
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

        Raises EOFError when it has died, and :class:`OutputError` when its job did.
        """
        try:
            message = self.connection.recv()
        except OSError:
            raise EOFError from None
        if isinstance(message, OutputError):
            raise message
        self.ready, self.attempt = True, None
        answer: Answer | None = message
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


def _serve(connection: Connection, start: Start, arguments: tuple[Any, ...]) -> None:
    """Do jobs until the other end closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_starter, daemon=True).start()
    os.environ["OCCLUDER_THREADS"] = "1"  # the processes share the processors
    work = start(*arguments)
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        connection.send(None)
        while True:
            job = connection.recv()
            try:
                message: Answer | OutputError = answer_of(work, job)
            except OutputError as error:
                message = error
            connection.send(message)


def _end_with_starter() -> None:
    """A job may take hours, which nobody would wait for any more."""
    starter = multiprocessing.parent_process()
    if starter is not None:
        starter.join()
        os._exit(1)
