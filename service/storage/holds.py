"""Which blobs a sweep must leave alone though no row names them yet."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager


class Holds:
    """Digests that open keepings hold, and those that were held at any time during a sweep.

    Whoever puts or finds a blob holds it first and looks at its file after that; whoever sweeps
    looks at the holds and moves the file away in one step.  So either the sweep sees the hold, or
    the other sees that the file is gone.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sweep_lock = threading.Lock()
        self._held: Counter[str] = Counter()
        self._noted: set[str] | None = None

    def add(self, digest: str) -> None:
        with self._lock:
            self._held[digest] += 1
            if self._noted is not None:
                self._noted.add(digest)

    def remove(self, digests: Iterable[str]) -> None:
        with self._lock:
            for digest in digests:
                self._held[digest] -= 1
                if not self._held[digest]:
                    del self._held[digest]

    @contextmanager
    def noting(self) -> Iterator[None]:
        """A sweep: what is held at its begin or later counts until its end.  One at a time."""
        with self._sweep_lock:
            with self._lock:
                self._noted = set(self._held)
            try:
                yield
            finally:
                with self._lock:
                    self._noted = None

    def unless_noted(self, digest: str, remove: Callable[[], object]) -> bool:
        """Within a sweep: remove what was not held since its begin; whether it was removed."""
        with self._lock:
            if self._noted is None:
                raise RuntimeError("nothing may be removed outside of a sweep")
            if digest in self._noted:
                return False
            remove()
            return True
