"""Reading a blob so that nobody gets all of it unless its bytes are those of its digest.

They are hashed as they are read.  The last of them are given only once the digest is known to be
right, so whoever gets to the end has the bytes that were stored, and whoever is sent others is left
with less than was announced.  For a part of a blob the rest is read as well, unless it was found to
be right a short while ago.

The cost is that of SHA-256, some 0.8 to 2 GiB/s of one processor, beside the reading; a part costs
as much as the whole, once in ten minutes.
"""

from __future__ import annotations

import hashlib
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from types import TracebackType
from typing import Protocol, Self

from service.jobs.job import Blob
from service.jobs.stores import DamagedBlobError

_BLOCK = 1 << 20
_TRUSTED_SECONDS = 600.0
_MOST_TRUSTED = 4096

_log = logging.getLogger(__name__)


class Source(Protocol):
    """Where the bytes of a blob come from, from the first on."""

    @property
    def mark(self) -> Hashable:
        """Equal only for sources of the very same bytes: a file that was not written to since."""

    def read(self, size: int) -> bytes:
        """The next bytes, ``size`` at most, none at the end.  An OSError tells of damage."""

    def skip(self, size: int) -> None: ...

    def close(self) -> None: ...


class BlobReader:
    """The :class:`~service.jobs.stores.Reader` of a source."""

    def __init__(
        self,
        source: Source,
        blob: Blob,
        start: int,
        stop: int,
        trusted: Trusted,
        on_damage: Callable[[], None],
    ) -> None:
        """``source`` is closed with the reader; ``on_damage`` hears that it is damaged."""
        self._source, self._blob = source, blob
        self._at, self._start, self._stop = start, start, stop
        self._trusted, self._on_damage = trusted, on_damage
        self._mark = source.mark
        whole = (start, stop) == (0, blob.size)
        self._hash = None if not whole and trusted.has(blob, self._mark) else hashlib.sha256()

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
        self._source.close()

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
            piece = self._source.read(size)
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
            self._source.skip(size)
            return
        while size > 0:
            size -= len(self._take(min(size, _BLOCK)))

    def _judge(self) -> None:
        if self._hash is None:
            return
        if self._hash.hexdigest() != self._blob.digest:
            raise self._damaged("its bytes are others than were stored")
        self._trusted.add(self._blob, self._mark)

    def _damaged(self, how: str) -> DamagedBlobError:
        self._trusted.remove(self._blob)
        self._on_damage()
        return DamagedBlobError(f"the blob {self._blob.digest} is damaged: {how}")


class Trusted:
    """Blobs that were found to be right a short while ago, each in a source.  Safe from any thread.

    A source that has changed since is another one, by its mark.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._found: OrderedDict[str, tuple[Hashable, float]] = OrderedDict()

    def has(self, blob: Blob, mark: Hashable) -> bool:
        with self._lock:
            found, when = self._found.get(blob.digest, (None, float("-inf")))
        return found == mark and self._clock() - when < _TRUSTED_SECONDS

    def add(self, blob: Blob, mark: Hashable) -> None:
        with self._lock:
            self._found[blob.digest] = (mark, self._clock())
            self._found.move_to_end(blob.digest)
            if len(self._found) > _MOST_TRUSTED:
                self._found.popitem(last=False)

    def remove(self, blob: Blob) -> None:
        with self._lock:
            self._found.pop(blob.digest, None)


class BrokenReads:
    """How often what was read for somebody turned out to be damaged.  Safe from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.count = 0

    def add(self) -> None:
        with self._lock:
            self.count += 1


def found_right(open_from: Callable[[Blob, int], BlobReader], blob: Blob) -> bool:
    """Whether a blob is there and right; one that is trusted is not read again.

    ``open_from``  opens it from a byte on, as :meth:`~service.jobs.stores.BlobStore.open` does.
    """
    try:
        with open_from(blob, max(0, blob.size - 1)) as reader:
            reader.read()
    except (KeyError, DamagedBlobError):
        return False
    return True


def log_damage(digest: str) -> None:
    """Say it where whoever runs the service looks."""
    _log.error("the blob %s is damaged, and was put aside; see docs/service.md", digest)
