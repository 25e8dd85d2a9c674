"""The threads at work, no more of them than processors, however calls are nested.

With three on two processors Linux may leave two of them on one for ten milliseconds, and the other
one idle.  So a thread that has nothing left to do takes chunks of another call, and one that waits
has another begin in its place.  A helper stays as long as a run, if it soon gets more to do: to
start one takes 50 to 200 microseconds, and to wake it a third of that.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Lock, Thread, current_thread

_PATIENCE = 0.005  # seconds that a helper waits for more to do

Work = Callable[[int, int], object]


class Hand:
    """A thread at some chunks; ``busy`` is held as long as it is.

    It does not know which: a cycle of references would keep what they work on in memory.
    """

    def __init__(self, thread: Thread) -> None:
        self.thread, self.busy = thread, Lock()
        self.busy.acquire()

    @property
    def has_begun(self) -> bool:
        """False where an interrupt kept the thread from starting; should it start later, it finds
        its chunks stopped."""
        return self.thread.ident is not None

    def wait(self, seconds: float = -1.0) -> bool:
        """Whether it is done within this time; -1 for any."""
        if not self.has_begun:
            return True
        if not self.busy.acquire(timeout=seconds):
            return False
        self.busy.release()
        return True


class Chunks:
    """A range in chunks, of which every thread takes the next.

    ``done`` are the numbers of those that are, ``errors`` what others raised, by number, and
    ``hands`` those that help, or did, beside the caller: ``most_hands`` at a time.
    """

    def __init__(self, work: Work, count: int, chunks: int, most_hands: int, crew: Crew) -> None:
        self.stopped = False
        self.done: list[int] = []
        self.errors: list[tuple[int, BaseException]] = []
        self.hands: list[Hand] = []
        self._work = work
        self._edges = [count * i // chunks for i in range(chunks + 1)]
        # One step of the interpreter each, so no two threads get the same number.
        self._next = itertools.count()
        self._begun = 0
        self._most_hands, self._crew = most_hands, crew

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
                if self.wants_help:
                    self._crew.hire([self])
                self._work(*self._edges[index : index + 2])
                self.done.append(index)
            except BaseException as error:
                self.stopped = True
                self.errors.append((index, error))


class _Helper:
    """A thread that helps with the ``chunks`` that it is given, as their ``hand``; none while it
    waits for ``wake``."""

    def __init__(self, work: Callable[[_Helper], None]) -> None:
        self.thread = Thread(target=work, args=(self,))
        self.chunks: Chunks | None = None
        self.hand = Hand(self.thread)
        self.wake = Lock()
        self.wake.acquire()


class Crew:
    """The threads at work, and the chunks that they may be helped with, in the order of the calls.

    ``most``  how many are to work.  One that waits is not at work.  When it goes on, there may be
              one more for as long as another takes for a chunk.
    """

    def __init__(self, most: Callable[[], int]) -> None:
        self._most = most
        self._lock = Lock()
        self._at_work: set[Thread] = set()
        self._offered: list[Chunks] = []
        self._runs = 0
        self._idle: list[_Helper] = []

    @contextmanager
    def running(self) -> Iterator[None]:
        """This thread is at work, and helpers stay meanwhile."""
        with self.working():
            with self._lock:
                self._runs += 1
            try:
                yield
            finally:
                self._dismiss()

    @contextmanager
    def working(self) -> Iterator[None]:
        """This thread is at work, if it was not."""
        thread = current_thread()
        if thread in self._at_work:
            yield
            return
        self._enter(thread)
        try:
            yield
        finally:
            self._leave(thread)

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """This thread is not at work meanwhile, if it was."""
        thread = current_thread()
        if thread not in self._at_work:
            yield
            return
        self._leave(thread)
        try:
            yield
        finally:
            self._enter(thread)

    @contextmanager
    def offering(self, chunks: Chunks) -> Iterator[None]:
        """Whoever has nothing to do helps with these; at the end they are stopped, and nobody is at
        them any more."""
        with self.working():
            try:
                with self._lock:
                    self._offered.append(chunks)
                yield
            finally:
                chunks.stopped = True
                self._finish(chunks)

    def hire(self, offered: Sequence[Chunks], *, surely: bool = False) -> None:
        """Have a thread help with the first that wants one, if another may work or ``surely``."""
        with self._lock:
            chunks = self._wanting(offered, surely=surely)
            if chunks is None:
                return
            is_new = not self._idle
            helper = _Helper(self._help) if is_new else self._idle.pop()
            self._give(helper, chunks)
        if is_new:
            helper.thread.start()
        else:
            helper.wake.release()

    def _enter(self, thread: Thread) -> None:
        with self._lock:
            self._at_work.add(thread)

    def _leave(self, thread: Thread) -> None:
        """Another may work in its place."""
        with self._lock:
            self._at_work.discard(thread)
        with suppress(RuntimeError):  # no more threads are to be had: then nobody helps
            self.hire(self._offered)

    def _finish(self, chunks: Chunks) -> None:
        with self._lock:
            if chunks in self._offered:  # no interrupt came before
                self._offered.remove(chunks)
        if any(hand.busy.locked() for hand in chunks.hands):
            with self.waiting():
                for hand in chunks.hands:
                    hand.wait()
        with self._lock:
            self._at_work -= {hand.thread for hand in chunks.hands if not hand.has_begun}

    def _dismiss(self) -> None:
        """With the last run end those that wait for something to help with."""
        with self._lock:
            self._runs -= 1
            if self._runs > 0:
                return
            idle, self._idle = self._idle, []
        for helper in idle:
            helper.wake.release()
        for helper in idle:
            helper.thread.join()

    def _wanting(self, offered: Sequence[Chunks], *, surely: bool = False) -> Chunks | None:
        """With the lock, as :meth:`_give`."""
        wanting = next((chunks for chunks in offered if chunks.wants_help), None)
        if wanting is not None and not surely and len(self._at_work) >= self._most():
            return None
        return wanting

    def _give(self, helper: _Helper, chunks: Chunks) -> None:
        self._at_work.add(helper.thread)
        helper.chunks, helper.hand = chunks, Hand(helper.thread)
        chunks.hands.append(helper.hand)

    def _help(self, helper: _Helper) -> None:
        """With its chunks, then with those of other calls, and with what soon comes."""
        while helper.chunks is not None:
            helper.chunks.run()
            helper.chunks = None
            with self._lock:
                helper.hand.busy.release()
                self._at_work.discard(helper.thread)
                chunks = self._wanting(self._offered)
                if chunks is not None:
                    self._give(helper, chunks)
                    del chunks  # which would keep what these work on while the helper waits
                    continue
                if self._runs == 0:
                    return
                self._idle.append(helper)
            helper.wake.acquire(timeout=_PATIENCE)
            with self._lock:
                if helper in self._idle:
                    self._idle.remove(helper)
