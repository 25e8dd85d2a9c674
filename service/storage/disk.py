"""What the file system is asked for: room, and that things last."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from service.errors import DiskFullError

_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
_REMEDY = "try again later; whoever runs the service has to make room or raise the quota"


def free_bytes(folder: Path) -> int:
    """What is left for us of the disk that the folder is on."""
    disk = os.statvfs(folder)
    return disk.f_bavail * disk.f_frsize


def check_room(folder: Path, size: int, min_free: int) -> None:
    """Raise :class:`DiskFullError` where ``size`` more bytes would leave less than ``min_free``."""
    if free_bytes(folder) - size < min_free:
        raise DiskFullError(f"less than {min_free:,} bytes would be left free", remedy=_REMEDY)


@contextmanager
def full_disk_told() -> Iterator[None]:
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
