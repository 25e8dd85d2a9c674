"""Where blobs lie in their folder, and what is done to one whose bytes are no longer its own.

    ``ab/cdef...``     a blob by its SHA-256.
    ``drafts/``        what is not whole yet.
    ``damaged/``       what was put aside: its bytes have another digest.

What is put aside is not stored: nobody is given it, a result that names it is made again, and who
sends the same bytes once more puts good ones in its place.  It is kept until then, or until no row
names it, for whoever wants to know what happened.  So one move on the disk marks a blob, for this
process, for others and for the next start.
"""

from __future__ import annotations

import errno
import hashlib
import os
import re
import stat
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from service.jobs.job import Blob
from service.jobs.stores import FOLDERS, BlobState
from service.storage.blobs.drafts import Draft, raising_disk_full, sync_folder

_DIGEST = re.compile(r"[0-9a-f]{64}")
_BLOCK = 1 << 20


@dataclass(frozen=True)
class BlobPlaces:
    """The places in one folder: a :class:`~service.jobs.stores.BlobInventory`."""

    folder: Path

    @property
    def drafts(self) -> Path:
        return self.folder / "drafts"

    @property
    def damaged(self) -> Path:
        return self.folder / "damaged"

    def make(self) -> None:
        """Make all folders now, so that who stores a blob need not make the name of one last."""
        for name in ["drafts", "damaged", *(f"{first:02x}" for first in range(FOLDERS))]:
            (self.folder / name).mkdir(parents=True, exist_ok=True)

    def place(self, digest: str) -> Path:
        """Raises KeyError for what is no digest, which might lead out of the folder."""
        if not _DIGEST.fullmatch(digest):
            raise KeyError(digest)
        return self.folder / digest[:2] / digest[2:]

    def has(self, blob: Blob) -> bool:
        """Whether there is a file of its size."""
        try:
            found = self.place(blob.digest).stat()
        except FileNotFoundError:
            return False
        return stat.S_ISREG(found.st_mode) and found.st_size == blob.size

    def find(self, blob: Blob) -> Path:
        """Raises KeyError where it is not there, or of another size."""
        if not self.has(blob):
            raise KeyError(blob.digest)
        return self.place(blob.digest)

    def digests(self) -> Iterator[str]:
        for first in range(FOLDERS):
            yield from self.digests_in(first)

    def digests_in(self, first: int) -> Iterator[str]:
        begin = f"{first:02x}"
        with suppress(FileNotFoundError):
            for name in os.listdir(self.folder / begin):  # noqa: PTH208 (half the time)
                if _DIGEST.fullmatch(begin + name):
                    yield begin + name

    def digests_aside(self) -> list[str]:
        with suppress(FileNotFoundError):
            return sorted(filter(_DIGEST.fullmatch, os.listdir(self.damaged)))  # noqa: PTH208
        return []

    def place_aside(self, digest: str) -> Path:
        """Where a blob lies that was put aside."""
        return self.damaged / digest

    def examine(
        self, digest: str, on_read: Callable[[int], object] = lambda size: None, *, aside: bool
    ) -> BlobState:
        """From the disk, not from memory, which is left to others."""
        return self._examine(self.place(digest), digest, on_read, aside=aside)

    def examine_aside(self, digest: str) -> BlobState:
        return self._examine(self.place_aside(digest), digest, lambda size: None, aside=False)

    def _examine(
        self, path: Path, digest: str, on_read: Callable[[int], object], *, aside: bool
    ) -> BlobState:
        try:
            file = path.open("rb", buffering=0)
        except FileNotFoundError:
            return BlobState.GONE
        with file:
            _forget(file.fileno())
            try:
                if digest_of(file.read, on_read) == digest:
                    return BlobState.WHOLE
            except OSError as error:
                if error.errno != errno.EIO:  # by which the disk tells that it cannot read it
                    raise
            finally:
                _forget(file.fileno())
            # While it is open no other file can be taken for it.
            if aside and not self.put_aside(digest, os.fstat(file.fileno())):
                return BlobState.GONE
            return BlobState.DAMAGED

    def put_aside(self, digest: str, seen: os.stat_result) -> bool:
        """Put a blob aside whose file, as ``seen``, had other bytes; whether it was still that one.

        Another may have come to its place since.  That one is taken along by mistake, and put back:
        for that moment it is not there.
        """
        place, aside = self.place(digest), self.place_aside(digest)
        try:
            if not os.path.samestat(place.stat(), seen):
                return False
            self.damaged.mkdir(exist_ok=True)
            place.replace(aside)
            if os.path.samestat(aside.stat(), seen):
                return True
            aside.replace(place)
        except FileNotFoundError:  # swept, or put aside by another
            pass
        return False

    def put_back(self, digest: str) -> None:
        self.place_aside(digest).replace(self.place(digest))

    def restore(self, digest: str, source: BinaryIO) -> bool:
        draft = Draft(self.drafts, 0)
        try:
            while block := source.read(_BLOCK):
                draft.write(block)
            if draft.seal().digest != digest:
                return False
            with raising_disk_full():
                draft.path.replace(self.place(digest))
                sync_folder(self.place(digest).parent)
        finally:
            draft.discard()
        self.place_aside(digest).unlink(missing_ok=True)
        return True


def digest_of(
    read: Callable[[int], bytes | None], on_read: Callable[[int], object] = lambda size: None
) -> str:
    """The SHA-256 in hex of what is read to its end."""
    found = hashlib.sha256()
    while block := read(_BLOCK):
        found.update(block)
        on_read(len(block))
    return found.hexdigest()


def _forget(handle: int) -> None:
    """Drop what the system keeps of a file in memory: the next read is of the disk."""
    if hasattr(os, "posix_fadvise"):
        os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)
