"""All blobs of a bucket, to be read anew and put right."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, BinaryIO

from service.jobs.job import Blob
from service.jobs.stores import BlobState
from service.storage.blobs.ledger import BlobLedger
from service.storage.blobs.s3_reading import LARGEST_PIECE, note_loss
from service.storage.blobs.s3_writing import S3Writer

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

_LOOKS = 3


class S3Inventory:
    """The :class:`~service.jobs.stores.BlobInventory` of a bucket."""

    def __init__(self, bucket: Bucket, ledger: BlobLedger, writer: S3Writer) -> None:
        self._bucket, self._ledger, self._writer = bucket, ledger, writer

    def digests(self) -> Iterator[str]:
        return self._ledger.digests("", "g")

    def digests_in(self, first: int) -> Iterator[str]:
        return self._ledger.digests(f"{first:02x}", f"{first:02x}g")  # no digit comes after f but g

    def digests_aside(self) -> Sequence[str]:
        return self._ledger.aside()

    def examine(
        self, digest: str, on_read: Callable[[int], object] = lambda size: None, *, aside: bool
    ) -> BlobState:
        for _ in range(_LOOKS):
            found = self._ledger.find(digest)
            if found is None:
                break
            key, size = found
            try:
                right = self._digest(key, size, on_read) == digest
            except KeyError:
                if self._ledger.find(digest) != found:
                    continue  # another has come in its place, or it was swept
                if aside:
                    note_loss(self._ledger, key, digest)
                break
            if right:
                return BlobState.WHOLE
            if not aside or self._ledger.put_aside(key):
                return BlobState.DAMAGED
        return BlobState.GONE

    def examine_aside(self, digest: str) -> BlobState:
        found = self._ledger.find(digest, aside=True)
        if found is None:
            return BlobState.GONE
        try:
            right = self._digest(*found, lambda size: None) == digest
        except KeyError:
            return BlobState.GONE
        return BlobState.WHOLE if right else BlobState.DAMAGED

    def put_back(self, digest: str) -> None:
        found = self._ledger.find(digest, aside=True)
        if found is not None:
            self._ledger.put_back(found[0], digest)

    def restore(self, digest: str, source: BinaryIO) -> bool:
        def is_it(blob: Blob) -> bool:
            return blob.digest == digest

        with self._writer.keeping() as keeping:
            return is_it(self._writer.put(source, keeping.publish, is_it))

    def _digest(self, key: str, size: int, on_read: Callable[[int], object]) -> str:
        """Of an object that is to have so many bytes, and of one more where there is one.

        Raises KeyError.
        """
        found, at = hashlib.sha256(), 0
        while at <= size:
            piece = self._bucket.get(key, at, min(at + LARGEST_PIECE, size + 1))
            found.update(piece)
            at += len(piece)
            on_read(len(piece))
            if not piece or at >= size:
                break
        return found.hexdigest()
