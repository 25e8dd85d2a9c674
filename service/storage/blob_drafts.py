"""A file on its way to become a blob."""

from __future__ import annotations

import hashlib
import os
import secrets
import threading
from pathlib import Path

from service.jobs.job import Blob
from service.storage.disk import check_room, full_disk_told

_READ_ONLY = 0o400


class Draft:
    """Bytes that are hashed as they are written; what they are called is known at their end.

    Its methods wait for each other, so :meth:`discard` leaves nothing behind even while another
    thread is in the midst of a write that nobody waits for any more.
    """

    def __init__(self, folder: Path, min_free: int) -> None:
        self.path = folder / f"{secrets.token_hex(16)}.tmp"
        self._min_free = min_free
        self._lock = threading.Lock()
        self._handle: int | None = None
        self._discarded = False
        self._hash = hashlib.sha256()
        self._size = 0

    def write(self, data: bytes | bytearray) -> None:
        """Raises :class:`~service.errors.DiskFullError`."""
        with self._lock, full_disk_told():
            handle = self._opened()
            check_room(self.path.parent, len(data), self._min_free)
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest) :]
            self._hash.update(data)
            self._size += len(data)

    def seal(self) -> Blob:
        """Make what was written last.  Raises :class:`~service.errors.DiskFullError`."""
        with self._lock, full_disk_told():
            os.fsync(self._opened())
            self._close()
            return Blob(self._hash.hexdigest(), self._size)

    def discard(self) -> None:
        """Remove it, unless it has been moved to its place; nothing can be written any more."""
        with self._lock:
            self._discarded = True
            self._close()
            self.path.unlink(missing_ok=True)

    def _opened(self) -> int:
        if self._discarded:
            raise ValueError(f"{self.path.name} was discarded")
        if self._handle is None:
            flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY
            self._handle = os.open(self.path, flags, _READ_ONLY)
        return self._handle

    def _close(self) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
