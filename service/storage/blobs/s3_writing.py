"""Putting blobs into the bucket: an object is sent under a new key, and then made the blob's."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import stat
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from service.errors import HoldLostError, ServiceError
from service.jobs.job import Blob
from service.storage.blobs.ledger import BlobLedger
from service.storage.blobs.ownership import Ownership
from service.storage.blobs.sending import SMALLEST_PART, Sending, in_thread, send

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

_log = logging.getLogger(__name__)

Publish = Callable[[str, Blob], None]
"""Has an object, by its key, be a blob's."""


class S3Writer:
    """Sends objects for one owner.

    ``part``  bytes of the parts that large ones are sent in.
    """

    def __init__(
        self, bucket: Bucket, ledger: BlobLedger, ownership: Ownership, part: int = SMALLEST_PART
    ) -> None:
        self._bucket, self._ledger, self._ownership, self._part = bucket, ledger, ownership, part

    @contextmanager
    def keeping(self) -> Iterator[S3Keeping]:
        keeping = S3Keeping(self, self._ledger, self._ownership)
        try:
            yield keeping
        finally:
            keeping.end()

    def put(
        self,
        source: BinaryIO,
        publish: Publish,
        wanted: Callable[[Blob], bool] = lambda blob: True,
    ) -> Blob:
        """Send all that is read, and publish the object, by its key, if it is wanted."""
        key = self._ownership.key()
        try:
            blob = send(self._bucket, key, source, self._part)
            if wanted(blob):
                self._publish(key, blob, publish)
            else:
                self._ownership.abandon(key)
        except BaseException:
            self._ownership.abandon(key)
            raise
        return blob

    def _publish(self, key: str, blob: Blob, publish: Publish) -> None:
        try:
            publish(key, blob)
        except HoldLostError:
            # A sweep may have looked for the object before it came, and will not come again.
            with suppress(ServiceError):
                self._bucket.delete([key])
                self._ownership.show_life()  # under another name, for those who come next
            raise

    async def put_stream(self, chunks: AsyncIterator[bytes], publish: Publish) -> Blob:
        """The same for what comes now and then."""
        key = await in_thread(self._key_to_send_to)
        sending = Sending(self._bucket, key, self._part)
        try:
            async for chunk in chunks:
                await sending.write(chunk)
            blob = await sending.finish()
            await in_thread(self._publish, key, blob, publish)
        except (Exception, asyncio.CancelledError):
            self._ownership.abandon(key)
            # Cancelled once more it goes on by itself.
            await asyncio.shield(sending.break_off())
            raise
        return blob

    def _key_to_send_to(self) -> str:
        self._bucket.check_there()
        return self._ownership.key()


class S3Keeping:
    """The :class:`~service.jobs.stores.Keeping` of a bucket."""

    def __init__(self, writer: S3Writer, ledger: BlobLedger, ownership: Ownership) -> None:
        self._writer, self._ledger, self._ownership = writer, ledger, ownership
        self._owner = ownership.name
        self._name = secrets.token_hex(16)
        self._ended = False

    def put(self, source: BinaryIO) -> Blob:
        self._check_open()
        return self._writer.put(source, self.publish)

    def put_file(self, path: Path) -> Blob:
        self._check_open()
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(handle, "rb") as file:
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                raise ValueError(f"{path} is no file")
            blob = self._writer.put(file, self.publish)
        path.unlink()
        return blob

    async def put_stream(self, chunks: AsyncIterator[bytes]) -> Blob:
        self._check_open()
        return await self._writer.put_stream(chunks, self.publish)

    def adopt(self, blob: Blob) -> None:
        self._check_open()
        self._ledger.adopt(self._owner, self._name, blob)
        self._see_to_end()

    def publish(self, key: str, blob: Blob) -> None:
        """Have an object that was put be the blob's, and hold that."""
        self._check_open()
        if self._ledger.publish(self._owner, self._name, key, blob):
            _log.info("the blob %s, which was damaged, is whole again", blob.digest)
        self._see_to_end()

    def end(self) -> None:
        """Hold nothing any more."""
        self._ended = True
        self._see_to_end()

    def _check_open(self) -> None:
        if self._ended:
            raise RuntimeError("the block of this keeping has ended")

    def _see_to_end(self) -> None:
        """It may have ended since the last look, in another thread."""
        if self._ended:
            self._ownership.end_keeping(self._name)
