"""The jobs that are being done, and the orders for each."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from service.engines.attempt import Orders
from service.jobs.job import Claim


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
        """All of them, and those that begin later."""
        with self._lock:
            self._stopped = True
        for _, orders in self.all():
            orders.stop()
