"""Blobs in a bucket, for several servers and workers that share it with their database.

An object's key says nothing of its bytes; the database tells which has which
(:mod:`service.storage.blobs.ledger`, where it is shown that nothing is removed that a row names).
So what was put is there for all at once, by a commit, and nothing is ever renamed, copied or
written over.  An equal blob that comes later takes the place of the one that was there, since its
bytes may have rotted; who is in the midst of reading that goes on with the new one.

All reading is checked, as it is of files: a server that takes wrong bytes, or gives other ones, is
found out.  What another process is to read is copied to the disk of its machine, where the latest
copies are kept.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from service.errors import ServiceError
from service.jobs.job import Blob
from service.jobs.stores import BlobState, DamagedBlobError
from service.storage.blobs.cache import BlobCache
from service.storage.blobs.ledger import BlobLedger
from service.storage.blobs.ownership import Ownership
from service.storage.blobs.reading import BlobReader, BrokenReads, Trusted, found_right, log_damage
from service.storage.blobs.s3_inventory import S3Inventory
from service.storage.blobs.s3_reading import LARGEST_PIECE, ObjectSource
from service.storage.blobs.s3_writing import S3Keeping, S3Writer
from service.storage.blobs.sending import SMALLEST_PART
from service.storage.blobs.sweeping import BucketSweep, Unnamed

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

_SIGNED_SECONDS = 900
"""For which an address is good that leads to the bucket."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class BucketParts:
    """What works on one bucket, for one owner."""

    bucket: Bucket
    ledger: BlobLedger
    ownership: Ownership
    writer: S3Writer
    inventory: S3Inventory
    sweep: BucketSweep

    @classmethod
    def of(
        cls, bucket: Bucket, ledger: BlobLedger, identity: str, part: int = SMALLEST_PART
    ) -> BucketParts:
        """``part``  bytes of the parts that large objects are sent in."""
        ownership = Ownership(ledger)
        writer = S3Writer(bucket, ledger, ownership, part)
        inventory = S3Inventory(bucket, ledger, writer)
        return cls(
            bucket, ledger, ownership, writer, inventory, BucketSweep(bucket, ledger, identity)
        )


class S3Blobs:
    """The :class:`~service.jobs.stores.BlobStore` of a bucket."""

    def __init__(self, parts: BucketParts, cache: BlobCache) -> None:
        self._bucket, self._ledger, self._ownership = parts.bucket, parts.ledger, parts.ownership
        self._writer, self._inventory = parts.writer, parts.inventory
        self._sweep, self._cache = parts.sweep, cache
        self._trusted = Trusted()
        self._broken = BrokenReads()

    def keeping(self) -> AbstractContextManager[S3Keeping]:
        return self._writer.keeping()

    def open(self, blob: Blob, start: int = 0, stop: int | None = None) -> BlobReader:
        source = ObjectSource(self._bucket, self._ledger, blob)
        part = start, blob.size if stop is None else stop
        if part[0] < part[1]:
            # Now, so that whoever asks is told at once that it is gone, or the server away.
            source.fetch(start if self._trusted.has(blob, source.mark) else 0)
        return BlobReader(source, blob, *part, self._trusted, partial(self._broke, blob, source))

    def has(self, blob: Blob) -> bool:
        with suppress(KeyError):
            self._ledger.key_of(blob)
            return True
        return False

    def lay_out(self, blob: Blob, place: Path) -> None:
        self._ledger.key_of(blob)
        self._cache.lay_out(blob, place, partial(self._pieces, blob))

    def _pieces(self, blob: Blob) -> Iterator[bytes]:
        """All of it.  Raises KeyError where it is gone, or damaged."""
        try:
            with self.open(blob) as reader:
                yield from iter(partial(reader.read, LARGEST_PIECE), b"")
        except DamagedBlobError:
            raise KeyError(blob.digest) from None

    def check(self, blob: Blob) -> bool:
        self._cache.drop(blob)  # it may be what is wrong
        state = self._inventory.examine(blob.digest, aside=True)
        if state is BlobState.DAMAGED:
            self._broken.add()
            log_damage(blob.digest)
        return state is BlobState.WHOLE

    def is_right(self, blob: Blob) -> bool:
        return found_right(self.open, blob)

    def signed_url(self, blob: Blob, media_type: str, disposition: str) -> str | None:
        told = {
            "response-content-disposition": disposition, "response-content-type": media_type,
        }  # fmt: skip
        return self._bucket.signed_url(self._ledger.key_of(blob), told, _SIGNED_SECONDS)

    @property
    def broken_reads(self) -> int:
        return self._broken.count

    @property
    def corrupt(self) -> int:
        return len(self._ledger.aside())

    def _broke(self, blob: Blob, source: ObjectSource) -> None:
        self._broken.add()
        try:
            # Of pieces of two objects nobody can tell which was damaged.
            if not source.moved and self._ledger.put_aside(source.key):
                log_damage(blob.digest)
        except ServiceError as error:
            _log.error("the blob %s is damaged, and cannot be put aside: %s", blob.digest, error)

    def digests(self) -> Iterator[str]:
        return self._inventory.digests()

    def sweep(self, unnamed: Unnamed) -> int:
        self._ownership.show_life()  # what nothing of this process holds any more
        return self._sweep.run(unnamed)

    def free_bytes(self) -> int:
        return self._cache.free_bytes()

    def problem(self) -> str | None:
        return self._bucket.problem()
