"""A file on its way to become a blob, and what the file system is asked for: room, and that things
last.
"""

from __future__ import annotations

import errno
import hashlib
import os
import secrets
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.errors import DiskFullError
from service.jobs.job import Blob

_READ_ONLY = 0o400

_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_REMEDY = "try again later; whoever runs the service has to make room or raise the quota"


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
        with self._lock, raising_disk_full():
            handle = self._open_handle()
            check_room(self.path.parent, len(data), self._min_free)
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(handle, rest) :]
            self._hash.update(data)
            self._size += len(data)

    def seal(self) -> Blob:
        """Make what was written last.  Raises :class:`~service.errors.DiskFullError`."""
        with self._lock, raising_disk_full():
            os.fsync(self._open_handle())
            self._close()
            return Blob(self._hash.hexdigest(), self._size)

    def discard(self) -> None:
        """Remove it, unless it has been moved to its place; nothing can be written any more."""
        with self._lock:
            self._discarded = True
            self._close()
            self.path.unlink(missing_ok=True)

    def _open_handle(self) -> int:
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


def free_bytes(folder: Path) -> int:
    """What is left for us of the disk that the folder is on."""
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize


def check_room(folder: Path, size: int, min_free: int) -> None:
    """Raise :class:`DiskFullError` where ``size`` more bytes would leave less than ``min_free``."""
    if free_bytes(folder) - size < min_free:
        raise DiskFullError(f"less than {min_free:,} bytes would be left free", remedy=_REMEDY)


@contextmanager
def raising_disk_full() -> Iterator[None]:
    """Turn a full disk, a used up quota and a file too large into :class:`DiskFullError`."""
    try:
        yield
    except OSError as error:
        if error.errno not in _FULL:
            raise
        raise DiskFullError(f"a write failed ({error.strerror})", remedy=_REMEDY) from error


def sync_folder(folder: Path) -> None:
    """Make the names in a folder last through a loss of power."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
