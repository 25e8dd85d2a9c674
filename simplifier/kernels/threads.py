"""Spread a kernel over the processors, or make something on one of them while the caller goes on.

Plain Python threads around ``nogil`` kernels instead of numba's ``prange``: the OpenMP layer dies
after a fork, the workqueue layer aborts when two threads call in, and ``parallel=True`` triples the
compile time.  A start costs some 50 to 200 microseconds, so each thread starts the next one, if
there is work for it: the caller of little work does not wait for the starts of sixteen.

However calls are nested, no more threads work than there are processors.  With three on two, Linux
may leave two of them on one processor for ten milliseconds, and the other one idle.  So a thread
that has nothing left to do takes chunks of another call, and one that waits starts one that does.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Event, Lock, Thread, current_thread
from typing import Generic, TypeVar

from simplifier.control_groups import allowed_processors
from simplifier.kernels.compiled.waiting import load_imported
from simplifier.progress import TellShare, silent


def thread_count() -> int:
    """Threads to use: ``OCCLUDER_THREADS``, else the processors that this process may use."""
    setting = os.environ.get("OCCLUDER_THREADS", "")
    if setting.isdecimal() and int(setting) > 0:
        return int(setting)
    return allowed_processors()


_GLANCE = 0.01  # seconds that the caller waits at most before it tells again

Work = Callable[[int, int], object]


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
    chunks = _Chunks(work, count, max(most, 1), min(threads, max(most, 1)) - 1 + watched)
    with working():
        try:
            _CREW.offer(chunks)
            if watched:
                _watch(chunks, tell)
            else:
                chunks.run()
        finally:
            chunks.stopped = True
            _CREW.finish(chunks)
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


@contextmanager
def working() -> Iterator[None]:
    """Count this thread among those at work, as :func:`run_chunks` does: meanwhile there is one
    less that helps others."""
    if _CREW.has(current_thread()):
        yield
        return
    _CREW.enter(current_thread())
    try:
        yield
    finally:
        _CREW.leave(current_thread())


@contextmanager
def _waiting() -> Iterator[None]:
    """This thread is not at work meanwhile, if it was."""
    if not _CREW.has(current_thread()):
        yield
        return
    _CREW.leave(current_thread())
    try:
        yield
    finally:
        _CREW.enter(current_thread())


class _Hand:
    """A thread at some chunks; ``busy`` is held as long as it is."""

    def __init__(self, thread: Thread, chunks: _Chunks) -> None:
        self.thread, self.chunks, self.busy = thread, chunks, Lock()
        self.busy.acquire()
        chunks.hands.append(self)

    @property
    def has_begun(self) -> bool:
        """Whether no interrupt kept the thread from starting, which else finds all stopped."""
        return self.thread.ident is not None

    def wait(self, seconds: float = -1.0) -> bool:
        """Whether it is done within this time; -1 for any."""
        if not self.has_begun:
            return True
        if not self.busy.acquire(timeout=seconds):
            return False
        self.busy.release()
        return True


class _Chunks:
    """A range in chunks, of which every thread takes the next.

    ``done`` are the numbers of those that are, ``errors`` what others raised, by number, and
    ``hands`` those that help, or did, beside the caller: ``most_hands`` at a time.
    """

    def __init__(self, work: Work, count: int, chunks: int, most_hands: int) -> None:
        self.stopped = False
        self.done: list[int] = []
        self.errors: list[tuple[int, BaseException]] = []
        self.hands: list[_Hand] = []
        self._work = work
        self._edges = [count * i // chunks for i in range(chunks + 1)]
        # One step of the interpreter each, so no two threads get the same number.
        self._next = itertools.count()
        self._begun = 0
        self._most_hands = most_hands

    def __len__(self) -> int:
        return len(self._edges) - 1

    @property
    def wants_help(self) -> bool:
        if self.stopped or self._begun >= len(self):
            return False
        return sum(hand.busy.locked() for hand in self.hands) < self._most_hands

    def run(self) -> None:
        """Have the next thread help, if there is work for it; then work until nothing is left, or
        someone failed."""
        while not self.stopped:
            index = next(self._next)
            if index >= len(self):
                return
            try:
                self._begun = index + 1
                _CREW.hire([self])
                self._work(*self._edges[index : index + 2])
                self.done.append(index)
            except BaseException as error:
                self.stopped = True
                self.errors.append((index, error))


class _Crew:
    """The threads at work, and the chunks that they may be helped with, in the order of the calls.

    One that waits is not at work.  When it goes on, there may be one more than processors for as
    long as another takes for a chunk.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._at_work: set[Thread] = set()
        self._offered: list[_Chunks] = []

    def has(self, thread: Thread) -> bool:
        return thread in self._at_work

    def enter(self, thread: Thread) -> None:
        with self._lock:
            self._at_work.add(thread)

    def leave(self, thread: Thread) -> None:
        """Another may work in its place."""
        with self._lock:
            self._at_work.discard(thread)
        with suppress(RuntimeError):  # no more threads are to be had: then nobody helps
            self.hire(self._offered)

    def offer(self, chunks: _Chunks) -> None:
        with self._lock:
            self._offered.append(chunks)

    def finish(self, chunks: _Chunks) -> None:
        """Wait until nobody is at these any more."""
        with self._lock:
            if chunks in self._offered:  # no interrupt came before
                self._offered.remove(chunks)
        if any(hand.busy.locked() for hand in chunks.hands):
            with _waiting():
                for hand in chunks.hands:
                    hand.wait()
        with self._lock:
            self._at_work -= {hand.thread for hand in chunks.hands if not hand.has_begun}

    def hire(self, offered: Sequence[_Chunks], *, surely: bool = False) -> None:
        """Start a thread at the first that wants one, if another may work or ``surely``."""
        with self._lock:
            chunks = self._wanting(offered, surely=surely)
            if chunks is None:
                return
            thread = Thread(target=lambda: self._help(hand))
            hand = self._hand(thread, chunks)
        thread.start()

    def _wanting(self, offered: Sequence[_Chunks], *, surely: bool = False) -> _Chunks | None:
        """With the lock, as :meth:`_hand`."""
        if not surely and len(self._at_work) >= thread_count():
            return None
        return next((chunks for chunks in offered if chunks.wants_help), None)

    def _hand(self, thread: Thread, chunks: _Chunks) -> _Hand:
        self._at_work.add(thread)
        return _Hand(thread, chunks)

    def _help(self, hand: _Hand) -> None:
        """With its chunks, and then with those of other calls."""
        while True:
            hand.chunks.run()
            with self._lock:
                hand.busy.release()
                self._at_work.discard(hand.thread)
                chunks = self._wanting(self._offered)
                if chunks is None:
                    return
                hand = self._hand(hand.thread, chunks)


_CREW = _Crew()


def _watch(chunks: _Chunks, tell: TellShare) -> None:
    """Have them done, and tell until all are or one has failed."""
    with _waiting():
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
            with _waiting():
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
            with working():
                self._made.append(self._make(self._dropped.is_set))
        except BaseException as error:
            self._error = error
