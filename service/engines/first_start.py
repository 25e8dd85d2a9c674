"""The first process gets ready alone: it compiles what all that come after it load.

With an empty cache that takes a minute or two of a processor.  Processes that began at once would
each compile the same, and be done later, for they would take the processors from each other.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_GLANCE = 0.05  # seconds between looks at whether to stop


class FirstStart:
    """Over as soon as one process was ready; until then one at a time may try.

    ``on_over``  called once, in the thread that brought it about.
    """

    def __init__(self, on_over: Callable[[], None]) -> None:
        self._on_over = on_over
        self._turn = threading.Lock()
        self._over = threading.Event()

    @contextmanager
    def turn(self, look: Callable[[], None]) -> Iterator[None]:
        """A block in which a process may be started; others wait for its end, or for a ready one.

        ``look`` is called while it is waited for, and ends the waiting by what it raises.
        """
        mine = False
        while not self._over.is_set() and not (mine := self._turn.acquire(timeout=_GLANCE)):
            look()
        try:
            yield
        finally:
            if mine:
                self._turn.release()

    def end(self) -> None:
        """A process is ready: there is no need to wait for each other any more."""
        if not self._over.is_set():
            self._over.set()
            self._on_over()
