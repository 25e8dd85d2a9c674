"""Who this process is to others that share its bucket: an owner that shows signs of life.

What can wait is done with the next of these: holds of keepings that have ended go, and so do keys
that nothing was put to.  So the end of a keeping costs nothing, and never fails.
"""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from service.background import in_background
from service.errors import HoldLostError, ServiceError
from service.storage.blobs.ledger import BlobLedger

_KEYS = 16
"""Keys that are written down at once: a commit for as many objects."""
_RENEWALS = 10
"""Signs of life within a lease."""
_AGAIN = 5.0
"""Seconds between tries while the database is away."""

_log = logging.getLogger(__name__)


class Ownership:
    """An owner of objects and holds; another one, by a new name, if it was taken for dead.

    Safe from any thread.
    """

    def __init__(self, ledger: BlobLedger) -> None:
        """Raises :class:`~service.errors.ServiceError` where the database cannot be used."""
        self._ledger = ledger
        self._lock = threading.Lock()
        self._name = secrets.token_hex(16)
        self._keys: list[str] = []
        self._ended: set[str] = set()
        self._abandoned: set[str] = set()
        ledger.join(self._name)

    @property
    def name(self) -> str:
        with self._lock:
            return self._name

    def key(self) -> str:
        """A new key that is written down.  Raises what the database raises."""
        with self._lock:
            if self._keys:
                return self._keys.pop()
            name = self._name
        try:
            keys = self._ledger.reserve(name, _KEYS)
        except HoldLostError:
            self.show_life()  # under another name from now on
            name = self.name
            keys = self._ledger.reserve(name, _KEYS)
        with self._lock:
            if name == self._name:
                self._keys += keys[1:]
        return keys[0]

    def end_keeping(self, keeping: str) -> None:
        """It holds nothing any more, soon."""
        with self._lock:
            self._ended.add(keeping)

    def abandon(self, key: str) -> None:
        """Nothing will be put to a key any more; what is there goes."""
        with self._lock:
            self._abandoned.add(key)

    def show_life(self) -> None:
        """Renew the lease, and do what has waited.  Raises what the database raises."""
        with self._lock:
            name, ended, abandoned = self._name, set(self._ended), set(self._abandoned)
        alive = self._ledger.renew(name, ended, abandoned)
        with self._lock:
            self._ended -= ended
            self._abandoned -= abandoned
        if not alive:
            self._begin_anew(name)

    def _begin_anew(self, before: str) -> None:
        """Under a name that counts before anybody can use it."""
        name = secrets.token_hex(16)
        self._ledger.join(name)
        with self._lock:
            if self._name == before:
                self._name = name
                self._keys.clear()
                _log.warning(
                    "this process was taken for dead; what it was storing has to be sent again"
                )
                return
        self._ledger.leave(name)  # another thread was first

    @contextmanager
    def living(self) -> Iterator[None]:
        """Show signs of life in a thread while the block lasts; then end in good order."""
        try:
            with in_background(self._live, "blob holds"):
                yield
        finally:
            with suppress(ServiceError):  # else others bury it
                self.show_life()
                self._ledger.leave(self.name)

    def _live(self, stop: threading.Event) -> None:
        pause = self._ledger.lease / _RENEWALS
        while not stop.wait(pause):
            try:
                self.show_life()
                pause = self._ledger.lease / _RENEWALS
            except Exception as error:
                ours = not isinstance(error, ServiceError)
                _log.error("holds of blobs cannot be renewed: %s", error, exc_info=ours)
                pause = min(_AGAIN, self._ledger.lease / _RENEWALS)
