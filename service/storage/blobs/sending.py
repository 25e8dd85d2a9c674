"""An object on its way to the bucket: hashed as it comes, and sent in parts if it is large.

What fits into one part goes in one request, once all of it is there.  Else a part is sent while
the next one comes, so that a few parts are in memory, however long the whole is.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from service.jobs.job import Blob

if TYPE_CHECKING:
    from service.storage.blobs.bucket import Bucket

SMALLEST_PART = 5 << 20
"""Bytes; S3 takes none that is smaller, but the last."""
_MOST_PARTS = 9_000
"""S3 takes 10,000."""
_BLOCK = 1 << 18
"""Bytes that are hashed at once."""

T = TypeVar("T")


def part_size(largest: int) -> int:
    """For objects of so many bytes at most."""
    return max(SMALLEST_PART, -(-largest // _MOST_PARTS))


def send(bucket: Bucket, key: str, source: BinaryIO, part: int) -> Blob:
    """Send all that is read.  Its errors and the bucket's pass through."""
    found, size = hashlib.sha256(), 0

    def parts() -> Iterator[bytearray]:
        nonlocal size
        while True:
            block = bytearray()
            while len(block) < part and (data := source.read(min(_BLOCK, part - len(block)))):
                found.update(data)
                block += data
            size += len(block)
            yield block
            if len(block) < part:
                return

    sent = parts()
    first = next(sent)
    if len(first) < part:
        bucket.put(key, first)
    else:
        bucket.put_parts(key, _chained(first, sent), part)
    return Blob(found.hexdigest(), size)


def _chained(first: bytearray, rest: Iterator[bytearray]) -> Iterator[bytearray]:
    yield first
    yield from filter(None, rest)


class Sending:
    """The same for bytes that come now and then: in the loop, which never waits for the network.

    To be ended by :meth:`finish` or :meth:`break_off`.
    """

    def __init__(self, bucket: Bucket, key: str, part: int) -> None:
        self._bucket, self._key, self._part = bucket, key, part
        self._hash, self._size = hashlib.sha256(), 0
        self._block, self._filling = bytearray(), bytearray()
        self._hashing: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._hashing.set_result(None)
        self._parts = _Parts()
        self._sent: asyncio.Task[None] | None = None

    async def write(self, data: bytes) -> None:
        """Raises what the bucket does, also of what was written before."""
        self._block += data
        if len(self._block) >= _BLOCK:
            await self._take_block()

    async def finish(self) -> Blob:
        """All was written.  Raises what the bucket does."""
        await self._take_block()
        await self._hashing
        if self._sent is None:
            await self._bucket.put_async(self._key, self._filling)
        else:
            if self._filling:
                await self._hand_over(self._filling)
            await self._hand_over(None)
            await asyncio.shield(self._sent)
        return Blob(self._hash.hexdigest(), self._size)

    async def break_off(self) -> None:
        """Have the server drop what came, if it came in parts."""
        if self._sent is not None:
            self._parts.fail()
            with suppress(Exception):
                await self._sent

    async def _take_block(self) -> None:
        block, self._block = self._block, bytearray()
        await self._hashing
        # In a thread, while the next one comes.
        self._hashing = in_thread(self._hash.update, block)
        self._size += len(block)
        rest = memoryview(block)
        while rest:
            room = self._part - len(self._filling)
            self._filling += rest[:room]
            rest = rest[room:]
            if len(self._filling) == self._part:
                part, self._filling = self._filling, bytearray()
                await self._hand_over(part)

    async def _hand_over(self, part: bytearray | None) -> None:
        """Returns once there is room for the next; None is the end."""
        if self._sent is None:
            sending = self._bucket.put_parts_async(self._key, self._parts, self._part)
            self._sent = asyncio.create_task(sending)
        given = asyncio.create_task(self._parts.give(part))
        try:
            await asyncio.wait({given, self._sent}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            given.cancel()
        if self._sent.done() and part is not None:
            self._sent.result()  # raises, as it cannot have come to an end


class _Parts:
    """Parts that one task gives and another takes."""

    def __init__(self) -> None:
        self._line: asyncio.Queue[bytearray | BrokenOffError | None] = asyncio.Queue(1)

    async def give(self, part: bytearray | None) -> None:
        await self._line.put(part)

    def fail(self) -> None:
        """Whoever takes gets an error, whatever was given."""
        if self._line.full():
            self._line.get_nowait()
        self._line.put_nowait(BrokenOffError())

    def __aiter__(self) -> _Parts:
        return self

    async def __anext__(self) -> bytearray:
        part = await self._line.get()
        if part is None:
            raise StopAsyncIteration
        if isinstance(part, BrokenOffError):
            raise part
        return part


class BrokenOffError(Exception):
    """Whoever sends does not go on."""


def in_thread(work: Callable[..., T], *args: object) -> asyncio.Future[T]:
    """Begin now, whether or not anybody waits."""
    return asyncio.get_running_loop().run_in_executor(None, work, *args)
