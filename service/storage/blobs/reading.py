"""Reading a blob so that nobody gets all of it unless its bytes are those of its digest.

They are hashed as they are read.  The last of them are given only once the digest is known to be
right, so whoever gets to the end has the bytes that were stored, and whoever is sent others is left
with less than was announced.  For a part of a blob the rest is read as well, unless the file was
found to be right a short while ago.

The cost is that of SHA-256, some 0.8 to 2 GiB/s of one processor, beside the reading; a part costs
as much as the whole, once in ten minutes.
"""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from types import TracebackType
from typing import BinaryIO, Self

from service.jobs.job import Blob
from service.jobs.stores import DamagedBlobError

_BLOCK = 1 << 20
_TRUSTED_SECONDS = 600.0
_MOST_TRUSTED = 4096


class BlobReader:
    """The :class:`~service.jobs.stores.Reader` of a file."""

    def __init__(
        self,
        file: BinaryIO,
        blob: Blob,
        start: int,
        stop: int,
        trusted: Trusted,
        on_damage: Callable[[os.stat_result], None],
    ) -> None:
        """``file`` is unbuffered, and closed with the reader; ``on_damage`` hears which it was."""
        self._file, self._blob = file, blob
        self._at, self._start, self._stop = start, start, stop
        self._trusted, self._on_damage = trusted, on_damage
        self._seen = os.fstat(file.fileno())
        whole = (start, stop) == (0, blob.size)
        self._hash = None if not whole and trusted.has(blob, self._seen) else hashlib.sha256()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        self._file.close()

    def read(self, size: int = -1) -> bytes:
        left = self._stop - self._at
        if left == 0:
            return b""
        try:
            if self._at == self._start:
                self._pass_over(self._start)
            data = self._take(left if size < 0 else min(size, left))
            self._at += len(data)
            if self._at == self._stop:
                self._pass_over(self._blob.size - self._stop)
                self._judge()
        except OSError as error:
            raise self._damaged(f"it cannot be read ({error.strerror})") from error
        return data

    def _take(self, size: int) -> bytes:
        """So many bytes and no less."""
        pieces = []
        while size > 0:
            piece = self._file.read(size)
            if not piece:
                raise self._damaged(f"{size:,} bytes are missing")
            pieces.append(piece)
            size -= len(piece)
        data = pieces[0] if len(pieces) == 1 else b"".join(pieces)
        if self._hash is not None:
            self._hash.update(data)
        return data

    def _pass_over(self, size: int) -> None:
        """What is not asked for: hashed too, unless there is no need."""
        if self._hash is None:
            self._file.seek(size, os.SEEK_CUR)
            return
        while size > 0:
            size -= len(self._take(min(size, _BLOCK)))

    def _judge(self) -> None:
        if self._hash is None:
            return
        if self._hash.hexdigest() != self._blob.digest:
            raise self._damaged("its bytes are others than were stored")
        self._trusted.add(self._blob, self._seen)

    def _damaged(self, how: str) -> DamagedBlobError:
        self._trusted.remove(self._blob)
        self._on_damage(self._seen)
        return DamagedBlobError(f"the blob {self._blob.digest} is damaged: {how}")


class Trusted:
    """Files that were found to be right a short while ago.  Safe from any thread.

    A file that was written to since is another one, by what the system notes of it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._found: OrderedDict[str, tuple[tuple[int, ...], float]] = OrderedDict()

    def has(self, blob: Blob, seen: os.stat_result) -> bool:
        with self._lock:
            mark, when = self._found.get(blob.digest, ((), float("-inf")))
        return mark == _mark(seen) and self._clock() - when < _TRUSTED_SECONDS

    def add(self, blob: Blob, seen: os.stat_result) -> None:
        with self._lock:
            self._found[blob.digest] = (_mark(seen), self._clock())
            self._found.move_to_end(blob.digest)
            if len(self._found) > _MOST_TRUSTED:
                self._found.popitem(last=False)

    def remove(self, blob: Blob) -> None:
        with self._lock:
            self._found.pop(blob.digest, None)


def _mark(seen: os.stat_result) -> tuple[int, ...]:
    return seen.st_dev, seen.st_ino, seen.st_size, seen.st_mtime_ns, seen.st_ctime_ns
