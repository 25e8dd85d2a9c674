"""A sweep of a bucket: what is removed, in steps of which each may be the last.

Any number of processes may sweep at once, be held up, or be killed in the midst: what is decided is
in the database, what is removed is never used again, and the next sweep goes on.

An object that a sweep takes from its blob is removed by the one after that.  So whoever was about
to read it has that long, and two sweeps leave nothing that is not needed.
"""

from __future__ import annotations

import random
import threading
from collections.abc import Callable, Collection
from itertools import islice
from typing import TYPE_CHECKING

from service.errors import NotReadyError
from service.jobs.stores import FOLDERS
from service.storage.blobs.ledger import BlobLedger

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

Unnamed = Callable[[Collection[str]], Collection[str]]
"""Which of some digests no row names."""

_BATCH = 1000


class BucketSweep:
    """Sweeps, one after the other.

    ``identity``  of the bucket, without which nothing is removed.
    """

    def __init__(self, bucket: Bucket, ledger: BlobLedger, identity: str) -> None:
        self._bucket, self._ledger, self._identity = bucket, ledger, identity
        self._next = random.randrange(FOLDERS)
        self._lock = threading.Lock()

    def run(self, unnamed: Unnamed) -> int:
        """How many blobs are stored no more.  Raises what ``unnamed``, bucket and database do."""
        with self._lock:
            if self._bucket.read_identity() != self._identity:
                raise NotReadyError(
                    f"{self._bucket.address} belongs to another database by now",
                    remedy="nothing is removed there; start again to see what is wrong",
                )
            self._ledger.bury_dead()
            self._remove_doomed()
            taken = self._take_unnamed(unnamed)
            self._take_aside(unnamed)
            self.remove_strays(self._next)
            self._next = (self._next + 1) % FOLDERS
            return taken

    def _remove_doomed(self) -> None:
        while doomed := self._ledger.doomed():
            for key, unfinished in doomed:
                if unfinished:
                    self._bucket.abort_uploads(key)
            keys = [key for key, _ in doomed]
            self._bucket.delete(keys)
            self._ledger.forget(keys)

    def _take_unnamed(self, unnamed: Unnamed) -> int:
        taken = 0
        for seen in self._ledger.sweepable():
            nobodys = set(unnamed([one.digest for one in seen]))
            taken += self._ledger.doom([one for one in seen if one.digest in nobodys])
        return taken

    def _take_aside(self, unnamed: Unnamed) -> None:
        aside = iter(self._ledger.aside())
        while some := list(islice(aside, _BATCH)):
            self._ledger.doom_aside(unnamed(some))

    def remove_strays(self, first: int | None = None) -> None:
        """Remove objects that no row knows: of all, or of those whose keys begin with a byte.

        They are those of a database that was put back as it was earlier, and of who was held up for
        long in the midst of a put, and killed then.  A key is in the database before its object
        comes, and until that has gone.
        """
        keys = self._bucket.keys(first)
        while some := list(islice(keys, _BATCH)):
            if strays := self._ledger.unknown(some):
                self._bucket.delete(sorted(strays))
