"""How the threads of an engine reach each other: a bell for work, and orders for jobs under way."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from service.jobs.job import Claim


class Bell:
    """Rung once or often before somebody waits, it wakes one waiter, at once."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._rung = self._closed = False

    def ring(self) -> None:
        with self._condition:
            self._rung = True
            self._condition.notify()

    def close(self) -> None:
        """No one waits any more, now or later."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    def wait(self, seconds: float) -> bool:
        """Whether it was rung within that time."""
        with self._condition:
            self._condition.wait_for(lambda: self._rung or self._closed, seconds)
            rung, self._rung = self._rung, False
            return rung


class Orders:
    """What others want of a running attempt.  Safe from any thread; none is ever taken back."""

    def __init__(self) -> None:
        self._cancel, self._drop, self._stop = (threading.Event() for _ in range(3))

    def cancel(self) -> None:
        """The job is not wanted any more."""
        self._cancel.set()

    def drop(self) -> None:
        """The lease is lost: somebody else has the job, and what comes of this is not heard."""
        self._drop.set()

    def stop(self) -> None:
        """The server stops; the job is to be done later."""
        self._stop.set()

    @property
    def cancelled(self) -> bool:
        return self._cancel.is_set()

    @property
    def dropped(self) -> bool:
        return self._drop.is_set()

    @property
    def stopped(self) -> bool:
        return self._stop.is_set()


class Running:
    """Claims under way.  Safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._orders: dict[str, tuple[Claim, Orders]] = {}
        self._stopped = False

    @contextmanager
    def at(self, claim: Claim) -> Iterator[Orders]:
        """A block in which the claim is worked at, its lease renewed, and its orders heard."""
        orders = Orders()
        with self._lock:
            self._orders[claim.job.id] = (claim, orders)
            if self._stopped:
                orders.stop()
        try:
            yield orders
        finally:
            with self._lock:
                # It may be claimed anew already, where the lease was lost.
                if self._orders.get(claim.job.id, (None, None))[1] is orders:
                    del self._orders[claim.job.id]

    @property
    def count(self) -> int:
        with self._lock:
            return len(self._orders)

    def all(self) -> list[tuple[Claim, Orders]]:
        with self._lock:
            return list(self._orders.values())

    def stop(self) -> None:
        """Stop all attempts, also those that begin later."""
        with self._lock:
            self._stopped = True
        for _, orders in self.all():
            orders.stop()
