"""The bytes of a blob from the bucket, some at a time.

Each piece is a request of its own.  So who takes them slowly keeps no connection open, and who is
in the midst goes on where another object has come in place of the one it began with.
"""

from __future__ import annotations

import errno
import logging
from collections.abc import Hashable
from typing import TYPE_CHECKING

from service.jobs.job import Blob
from service.storage.blobs.ledger import BlobLedger

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

_FIRST = 1 << 20
LARGEST_PIECE = 4 << 20
"""Bytes that are asked for at once: fewer at first, since most blobs are small."""
_LOOKS = 3

_log = logging.getLogger(__name__)


class ObjectSource:
    """The :class:`~service.storage.blobs.reading.Source` of a blob.

    ``key``    of the object that it began with.
    ``moved``  whether it has gone on with another.
    """

    def __init__(self, bucket: Bucket, ledger: BlobLedger, blob: Blob) -> None:
        """Raises KeyError where it is not stored."""
        self._bucket, self._ledger, self._blob = bucket, ledger, blob
        self.key = self._now = ledger.key_of(blob)
        self.moved = False
        self._at = self._begin = 0
        self._piece = memoryview(b"")
        self._size = _FIRST

    @property
    def mark(self) -> Hashable:
        return self.key

    def fetch(self, at: int) -> None:
        """Have the bytes there at hand.  Raises KeyError where the object is gone."""
        stop = min(at + self._size, self._blob.size)
        self._size = min(2 * self._size, LARGEST_PIECE)
        self._piece, self._begin = self._get(at, stop), at

    def read(self, size: int) -> bytes:
        if self._at >= self._blob.size:
            return b""
        if not self._begin <= self._at < self._begin + len(self._piece):
            try:
                self.fetch(self._at)
            except KeyError:
                raise FileNotFoundError(errno.ENOENT, "it is gone") from None
        begin = self._at - self._begin
        data = bytes(self._piece[begin : begin + size])
        self._at += len(data)
        return data

    def skip(self, size: int) -> None:
        self._at += size

    def close(self) -> None:
        self._piece = memoryview(b"")

    def _get(self, start: int, stop: int) -> memoryview:
        for _ in range(_LOOKS):
            try:
                return self._bucket.get(self._now, start, stop)
            except KeyError:
                now = self._ledger.key_of(self._blob)
                if now == self._now:
                    note_loss(self._ledger, now, self._blob.digest)
                    raise
                self._now, self.moved = now, True
        raise KeyError(self._blob.digest)


def note_loss(ledger: BlobLedger, key: str, digest: str) -> None:
    """The object of a blob is not in the bucket, whatever the database says."""
    if ledger.put_aside(key):
        _log.error("the blob %s is gone from the bucket; see docs/service.md", digest)
