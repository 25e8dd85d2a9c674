"""The thread that keeps the leases of jobs under way, and hears which of these are to end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import suppress

from service.engines.signals import Bell
from service.engines.slot import Shop
from service.engines.trouble import StoppedError

_POLL = 1.0  # seconds between looks for jobs that nobody has told of
_LEAST_BETWEEN = 0.1  # seconds between looks, however often it is woken
_RENEWALS = 3.0  # in the time of a lease

logger = logging.getLogger(__name__)


class LeaseKeeper:
    """Looks after all claims that are under way in a shop."""

    def __init__(self, shop: Shop, *, shared: bool) -> None:
        """``shared``  whether others may ask for the end of a job without waking this one."""
        self._shop, self._shared = shop, shared
        self._look = Bell()

    def wake(self) -> None:
        """A job waits, or is to end: look now rather than later.  From any thread."""
        self._look.ring()

    def close(self) -> None:
        """Nobody is woken any more."""
        self._look.close()

    def run(self, before: Callable[[], None], on_begin: Callable[[], None]) -> None:
        """Renew leases, hear of jobs that are to end, and ring for those that wait.

        Returns when the shop's trouble tells to stop.  ``on_begin`` is called once ``before`` is
        done, which may wait for the stores.
        """
        with suppress(StoppedError):
            self._faultless(before)
            on_begin()
            due = time.monotonic()
            while True:
                if self._look.wait(min(_POLL, max(due - time.monotonic(), 0.0))) or self._shared:
                    self._faultless(self._hear)
                if time.monotonic() >= due:
                    self._faultless(self._renew)
                    due = time.monotonic() + self._shop.settings.lease_seconds / _RENEWALS
                self._shop.bell.ring()
                self._shop.trouble.pause(_LEAST_BETWEEN)

    def _faultless(self, call: Callable[[], None]) -> None:
        """Leases are to be kept whatever happens."""
        try:
            self._shop.trouble.insist(call)
        except StoppedError:
            raise
        except Exception:
            logger.exception("leases could not be kept by a fault of the program")

    def _hear(self) -> None:
        """Look which jobs are to end: this only reads, however often the engine is woken."""
        under_way = self._shop.running.all()
        if under_way:
            ending = self._shop.jobs.cancelled([claim for claim, _ in under_way])
            for claim, orders in under_way:
                if claim.job.id in ending:
                    orders.cancel()

    def _renew(self) -> None:
        """Tell attempts what has become of their leases."""
        under_way = self._shop.running.all()
        if under_way:
            held = self._shop.jobs.renew(
                [claim for claim, _ in under_way], self._shop.settings.lease_seconds
            )
            for claim, orders in under_way:
                if claim.job.id not in held:
                    orders.drop()
                elif held[claim.job.id]:
                    orders.cancel()
