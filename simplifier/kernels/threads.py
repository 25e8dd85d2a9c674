"""Spread a kernel over the processors, or make something on one of them while the caller goes on.

Plain Python threads around ``nogil`` kernels instead of numba's ``prange``: the OpenMP layer dies
after a fork, the workqueue layer aborts when two threads call in, and ``parallel=True`` triples the
compile time.  Each thread starts the next one, if there is work for it: the caller of little work
does not wait for the starts of sixteen.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any, Generic, TypeVar

from simplifier.control_groups import allowed_processors
from simplifier.kernels.compiled.waiting import load_imported
from simplifier.kernels.crew import Chunks, Crew, Work
from simplifier.progress import TellShare, silent


def thread_count() -> int:
    """Threads to use: ``OCCLUDER_THREADS``, else the processors that this process may use."""
    setting = os.environ.get("OCCLUDER_THREADS", "")
    if setting.isdecimal() and int(setting) > 0:
        return int(setting)
    return allowed_processors()


_CREW = Crew(thread_count)

_GLANCE = 0.01  # seconds that the caller waits at most before it tells again


def run_chunks(
    work: Work,
    count: int,
    *,
    least: int = 1,
    chunks_per_thread: int = 4,
    tell: TellShare = silent,
) -> None:
    """Call ``work(begin, end)`` over the range 0..count in chunks, on all threads.

    ``work`` must write only to places that belong to its range: the result is then the same on any
    number of threads.  ``least`` is the smallest chunk worth a hand-over.  This thread works as
    well; with ``tell`` it only watches, and tells the share of the chunks that are done every few
    milliseconds.

    An exception, of ``work``, ``tell`` or an interrupt, is raised again here, of several that of
    the first chunk.  Chunks that have not begun are then left out, and no thread works any more.
    """
    load_imported()  # in the caller's thread, which hears Ctrl-C
    threads = thread_count()
    most = min(threads * chunks_per_thread, count // max(least, 1))
    if count == 0:
        return
    if tell is silent and (threads == 1 or most < 2):
        work(0, count)
        return
    watched = tell is not silent
    hands = min(threads, max(most, 1)) - 1 + watched
    chunks = Chunks(work, count, max(most, 1), hands, _CREW)
    with _CREW.offering(chunks):
        if watched:
            _watch(chunks, tell)
        else:
            chunks.run()
    if chunks.errors:
        raise min(chunks.errors)[1]


Given = TypeVar("Given")
Made = TypeVar("Made")


def run_each(make: Callable[[Given], Made], given: Sequence[Given]) -> list[Made]:
    """``make`` of each, in their order: several at the same time, as :func:`run_chunks`."""
    made: dict[int, Made] = {}

    def work(begin: int, end: int) -> None:
        for index in range(begin, end):
            made[index] = make(given[index])

    run_chunks(work, len(given))
    return [made[index] for index in range(len(given))]


First = TypeVar("First")
Second = TypeVar("Second")


def run_both(first: Callable[[], First], second: Callable[[], Second]) -> tuple[First, Second]:
    """What both return, made at the same time, as :func:`run_each`; this thread begins with the
    first."""
    makers: Sequence[Callable[[], Any]] = (first, second)
    made = run_each(lambda make: make(), makers)
    return made[0], made[1]


@contextmanager
def running() -> Iterator[None]:
    """Around a run of many calls: between them, too, this thread counts among those at work, so
    that there is one less that helps others, and those that help stay for the next call."""
    with _CREW.running():
        yield


def _watch(chunks: Chunks, tell: TellShare) -> None:
    """Have them done, and tell until all are or one has failed."""
    with _CREW.waiting():
        _CREW.hire([chunks], surely=True)
        for hand in chunks.hands:  # others come while one is at work
            while not hand.wait(_GLANCE):
                tell(len(chunks.done) / len(chunks))
    if not chunks.errors:
        tell(1.0)


Stopped = Callable[[], bool]
"""Whether nobody waits for a result any more."""


class Ahead(Generic[Made]):
    """What ``make`` returns: made when it is asked for, or before, while the caller goes on.

    ``make(stopped)`` should end soon after ``stopped()`` is true, by an exception.
    """

    def __init__(self, make: Callable[[Stopped], Made]) -> None:
        self._make = make
        self._dropped = Event()
        self._made: list[Made] = []
        self._error: BaseException | None = None
        self._thread: Thread | None = None

    def begin(self) -> None:
        """Make it on a thread of its own from now on, unless there is but one to use."""
        if self._thread is None and not self._made and thread_count() > 1:
            load_imported()  # in the caller's thread, which hears Ctrl-C
            thread = Thread(target=self._run)
            thread.start()
            self._thread = thread

    def result(self, stopped: Stopped = lambda: False) -> Made:
        """Wait for it, or make it; ``stopped`` is called on the caller's thread alone.

        Raises what ``make`` raises.
        """
        if self._thread is not None:
            with _CREW.waiting():
                while self._thread.is_alive():
                    self._thread.join(_GLANCE)
                    if stopped():
                        self._dropped.set()
        elif not self._made:
            self._made.append(self._make(stopped))
        if self._error is not None:
            raise self._error
        return self._made[0]

    def close(self) -> None:
        """Nobody asks any more: tell the maker to end, and wait until it has."""
        self._dropped.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            with _CREW.working():
                self._made.append(self._make(self._dropped.is_set))
        except BaseException as error:
            self._error = error
