"""Copies of blobs on the disk of this machine, for processes that read files: the latest ones.

Safe beside other processes that use the same folder.  A copy has its name once it is whole; it is
linked to where it is wanted, and so stays for whoever has it when the cache lets go of it.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from weakref import WeakValueDictionary

from service.errors import SettingsError
from service.jobs.job import Blob
from service.storage.blobs.drafts import check_room, free_bytes, raising_disk_full

_READ_ONLY = 0o400
_ABANDONED = 3600.0
"""Seconds after which a copy that nothing was written to any more is that of a killed process."""
_SUFFIX = ".tmp"

Blocks = Callable[[], Iterator[bytes]]
"""The bytes of a blob, from elsewhere; raises what there is to raise."""


class BlobCache:
    """At most ``limit`` bytes of copies, in a folder; ``min_free`` of the disk are left to others.

    A blob that is larger than the cache is copied to where it is wanted, and there alone.
    """

    def __init__(self, folder: Path, limit: int, min_free: int = 0) -> None:
        """Make the folder where there is none.  Raises :class:`~service.errors.SettingsError`."""
        self._folder, self._limit, self._min_free = folder, limit, min_free
        self._lock = threading.Lock()
        self._copying = WeakValueDictionary[str, threading.Lock]()
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._remove_abandoned()
        except OSError as error:
            raise SettingsError(
                f"the folder of copies '{folder}' cannot be used ({error.strerror}); "
                "check its permissions and the free space"
            ) from error

    def lay_out(self, blob: Blob, place: Path, blocks: Blocks) -> None:
        """Make a file with the bytes of a blob.  Raises :class:`~service.errors.DiskFullError`."""
        with raising_disk_full():
            if blob.size > self._limit:
                self._write(place, blob, blocks)
                return
            with self._turn(blob):
                if self._link(blob, place):
                    return
                copy = self._folder / f"{secrets.token_hex(16)}{_SUFFIX}"
                try:
                    self._make_room(blob.size)
                    self._write(copy, blob, blocks)
                    _link_or_copy(copy, place)
                    copy.replace(self._folder / blob.digest)
                finally:
                    copy.unlink(missing_ok=True)

    def drop(self, blob: Blob) -> None:
        """Have it copied anew when it is wanted again."""
        (self._folder / blob.digest).unlink(missing_ok=True)

    def free_bytes(self) -> int:
        return free_bytes(self._folder)

    def _link(self, blob: Blob, place: Path) -> bool:
        """Whether there was a copy."""
        copy = self._folder / blob.digest
        try:
            if copy.stat().st_size != blob.size:
                return False
            os.utime(copy)  # it was wanted now
            _link_or_copy(copy, place)
        except FileNotFoundError:  # another process let go of it
            return False
        return True

    def _write(self, path: Path, blob: Blob, blocks: Blocks) -> None:
        check_room(self._folder, blob.size, self._min_free)
        try:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _READ_ONLY)
            with os.fdopen(handle, "wb", buffering=0) as file:
                for block in blocks():
                    rest = memoryview(block)
                    while rest:
                        rest = rest[file.write(rest) :]
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    def _make_room(self, size: int) -> None:
        """Let go of those that were not wanted for longest."""
        files = sorted(self._files())
        total = sum(length for _, length, _ in files)
        for _, length, path in files:
            short = free_bytes(self._folder) - size < self._min_free
            if total + size <= self._limit and not short:
                return
            if path.suffix != _SUFFIX:
                path.unlink(missing_ok=True)
                total -= length

    def _files(self) -> Iterator[tuple[int, int, Path]]:
        """When each was last wanted or written, its size and its path."""
        with os.scandir(self._folder) as entries:
            for entry in entries:
                with suppress(FileNotFoundError):
                    found = entry.stat()
                    yield found.st_mtime_ns, found.st_size, Path(entry.path)

    def _remove_abandoned(self) -> None:
        before = time.time() - _ABANDONED
        for path in self._folder.glob(f"*{_SUFFIX}"):
            with suppress(FileNotFoundError):
                if path.stat().st_mtime < before:
                    path.unlink()

    def _turn(self, blob: Blob) -> threading.Lock:
        """Of those who want the same, the first copies it; it is kept as long as one has it."""
        with self._lock:
            return self._copying.setdefault(blob.digest, threading.Lock())


def _link_or_copy(copy: Path, place: Path) -> None:
    """A link, or on another disk a copy."""
    try:
        os.link(copy, place)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        shutil.copyfile(copy, place)
        place.chmod(_READ_ONLY)
