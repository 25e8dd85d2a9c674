"""Blobs in a folder: ``ab/cdef...`` by their SHA-256, whole from the moment they have that name.

A blob is written to ``drafts/``, made last by fsync, and renamed.  What a killed server leaves are
drafts, which the next one removes, and blobs that no row names, which a sweep does.  What a sweep
must leave alone though no row names it yet is held.

Bytes may rot once they are there.  So an equal blob that comes later takes the place of the one
that was there, which costs nothing, as it is on the disk already; and all reading is checked.
"""

from __future__ import annotations

import asyncio
import logging
import os
import stat
import threading
from collections import Counter
from collections.abc import AsyncIterator, Callable, Collection, Hashable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from pathlib import Path
from typing import BinaryIO, TypeVar

from service.errors import SettingsError
from service.jobs.job import Blob
from service.jobs.stores import BlobState
from service.storage.blobs.drafts import Draft, free_bytes, raising_disk_full, sync_folder
from service.storage.blobs.places import BlobPlaces, digest_of
from service.storage.blobs.reading import BlobReader, BrokenReads, Trusted, found_right, log_damage

_BLOCK = 1 << 18
"""Bytes that go to a thread at once.  More is hardly faster, and each slow upload holds as many."""

_BATCH = 1000
"""Digests that a sweep asks after at once."""

T = TypeVar("T")

_log = logging.getLogger(__name__)


class FileBlobs:
    """The :class:`~service.jobs.stores.BlobStore` of one server, in a folder of its own.

    ``min_free`` bytes of the disk are left to others.
    """

    def __init__(self, folder: Path, *, min_free: int = 0) -> None:
        """Make the folder where there is none.  Raises :class:`~service.errors.SettingsError`."""
        self.places = BlobPlaces(folder)
        self._min_free = min_free
        self._holds = Holds()
        self._trusted = Trusted()
        self._broken = BrokenReads()
        try:
            self.places.make()
            sync_folder(folder)
            for draft in self.places.drafts.iterdir():
                draft.unlink()
        except OSError as error:
            raise SettingsError(
                f"the folder of blobs '{folder}' cannot be used ({error.strerror}); "
                "check its permissions and the free space"
            ) from error

    @contextmanager
    def keeping(self) -> Iterator[FileKeeping]:
        keeping = FileKeeping(self, self._holds)
        try:
            yield keeping
        finally:
            keeping.end()

    def open(self, blob: Blob, start: int = 0, stop: int | None = None) -> BlobReader:
        try:
            file = self.path(blob).open("rb", buffering=0)
        except FileNotFoundError:  # swept since, for no row names it
            raise KeyError(blob.digest) from None
        part = start, blob.size if stop is None else stop
        source = _FileSource(file)
        return BlobReader(
            source, blob, *part, self._trusted, partial(self._broke, blob.digest, source.seen)
        )

    def has(self, blob: Blob) -> bool:
        return self.places.has(blob)

    def lay_out(self, blob: Blob, place: Path) -> None:
        place.symlink_to(self.path(blob).resolve())

    def path(self, blob: Blob) -> Path:
        """Its file.  Raises KeyError."""
        return self.places.find(blob)

    def signed_url(self, blob: Blob, media_type: str, disposition: str) -> str | None:
        return None

    def check(self, blob: Blob) -> bool:
        state = self.places.examine(blob.digest, aside=True)
        if state is BlobState.DAMAGED:
            self._broken.add()
            log_damage(blob.digest)
        return state is BlobState.WHOLE

    def is_right(self, blob: Blob) -> bool:
        return found_right(self.open, blob)

    @property
    def broken_reads(self) -> int:
        return self._broken.count

    @property
    def corrupt(self) -> int:
        return len(self.places.digests_aside())

    def _broke(self, digest: str, seen: os.stat_result) -> None:
        self._broken.add()
        try:
            if self.places.put_aside(digest, seen):
                log_damage(digest)
        except OSError as error:
            _log.error("the blob %s is damaged, and cannot be put aside: %s", digest, error)

    def digests(self) -> Iterator[str]:
        return self.places.digests()

    def sweep(self, unnamed: Callable[[Collection[str]], Collection[str]]) -> int:
        with self._holds.noting():
            digests = self.digests()
            batches = iter(lambda: list(islice(digests, _BATCH)), [])
            removed = sum(self._remove(digest) for batch in batches for digest in unnamed(batch))
            if aside := self.places.digests_aside():
                for digest in unnamed(aside):
                    self.places.place_aside(digest).unlink(missing_ok=True)
            return removed

    def _remove(self, digest: str) -> bool:
        """Within a sweep; whether it was not held."""
        # Out of its place at once; taking long to free the disk then keeps nobody waiting.
        draft = self.places.drafts / f"{digest}.tmp"
        removed = self._holds.remove_unless_noted(
            digest, partial(self.places.place(digest).replace, draft)
        )
        if removed:
            draft.unlink()
        return removed

    def free_bytes(self) -> int:
        return free_bytes(self.places.folder)

    def problem(self) -> str | None:
        return None  # what a disk may have is told beside it

    def draft(self) -> Draft:
        """A file to be filled and then published."""
        return Draft(self.places.drafts, self._min_free)

    def publish(self, path: Path, blob: Blob) -> None:
        """Move a whole, lasting file to its place, where it takes that of an equal one."""
        place = self.places.place(blob.digest)
        with raising_disk_full():
            path.replace(place)
            sync_folder(place.parent)
        with suppress(FileNotFoundError):
            self.places.place_aside(blob.digest).unlink()
            _log.info("the blob %s, which was damaged, is whole again", blob.digest)


class _FileSource:
    """A file, which is unbuffered, and closed with this."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.seen = os.fstat(file.fileno())

    @property
    def mark(self) -> Hashable:
        seen = self.seen
        return seen.st_dev, seen.st_ino, seen.st_size, seen.st_mtime_ns, seen.st_ctime_ns

    def read(self, size: int) -> bytes:
        return self._file.read(size)

    def skip(self, size: int) -> None:
        self._file.seek(size, os.SEEK_CUR)

    def close(self) -> None:
        self._file.close()


class FileKeeping:
    """The :class:`~service.jobs.stores.Keeping` of :class:`FileBlobs`."""

    def __init__(self, store: FileBlobs, holds: Holds) -> None:
        self._store = store
        self._holds = holds
        self._lock = threading.Lock()
        self._held: set[str] = set()
        self._ended = False

    def put(self, source: BinaryIO) -> Blob:
        draft = self._store.draft()
        try:
            while data := source.read(_BLOCK):
                draft.write(data)
            return self._publish(draft)
        finally:
            draft.discard()

    def put_file(self, path: Path) -> Blob:
        with raising_disk_full():
            blob = _seal(path)
            self._hold(blob.digest)
            self._store.publish(path, blob)
        return blob

    async def put_stream(self, chunks: AsyncIterator[bytes]) -> Blob:
        # One block is written and hashed in a thread while the next one comes.
        draft = self._store.draft()
        writing: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        writing.set_result(None)
        try:
            block = bytearray()
            async for chunk in chunks:
                block += chunk
                if len(block) >= _BLOCK:
                    await writing
                    writing = _in_thread(draft.write, block)
                    block = bytearray()
            await writing
            return await _in_thread(self._finish, draft, block)
        except (Exception, asyncio.CancelledError):
            # The thread may be in the midst of a write; to be cancelled again does no harm.  What
            # ends the process is left out: there is no loop any more, and the next start removes.
            removal = asyncio.gather(writing, _in_thread(draft.discard), return_exceptions=True)
            await asyncio.shield(removal)
            raise

    def adopt(self, blob: Blob) -> None:
        self._hold(blob.digest)
        self._store.path(blob)

    def end(self) -> None:
        """Hold nothing any more."""
        with self._lock:
            self._ended = True
            self._holds.remove(self._held)

    def _finish(self, draft: Draft, last: bytearray) -> Blob:
        try:
            draft.write(last)
            return self._publish(draft)
        finally:
            draft.discard()

    def _publish(self, draft: Draft) -> Blob:
        blob = draft.seal()
        self._hold(blob.digest)
        self._store.publish(draft.path, blob)
        return blob

    def _hold(self, digest: str) -> None:
        with self._lock:
            if self._ended:
                raise RuntimeError("the block of this keeping has ended")
            if digest not in self._held:
                self._held.add(digest)
                self._holds.add(digest)


def _in_thread(work: Callable[..., T], *args: object) -> asyncio.Future[T]:
    """Begin now, whether or not anybody waits."""
    return asyncio.get_running_loop().run_in_executor(None, work, *args)


def _seal(path: Path) -> Blob:
    """Make a file last as it is, for nobody to write to."""
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise ValueError(f"{path} is no file")
        digest = digest_of(file.read)
        os.fchmod(handle, 0o400)
        os.fsync(handle)
        return Blob(digest, file.tell())


class Holds:
    """Digests that open keepings hold, and those that were held at any time during a sweep.

    Whoever puts or finds a blob holds it first and looks at its file after that; whoever sweeps
    looks at the holds and moves the file away in one step.  So either the sweep sees the hold, or
    the other sees that the file is gone.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sweep_lock = threading.Lock()
        self._held: Counter[str] = Counter()
        self._noted: set[str] | None = None

    def add(self, digest: str) -> None:
        with self._lock:
            self._held[digest] += 1
            if self._noted is not None:
                self._noted.add(digest)

    def remove(self, digests: Iterable[str]) -> None:
        with self._lock:
            for digest in digests:
                self._held[digest] -= 1
                if not self._held[digest]:
                    del self._held[digest]

    @contextmanager
    def noting(self) -> Iterator[None]:
        """A sweep: what is held at its begin or later counts until its end.  One at a time."""
        with self._sweep_lock:
            with self._lock:
                self._noted = set(self._held)
            try:
                yield
            finally:
                with self._lock:
                    self._noted = None

    def remove_unless_noted(self, digest: str, remove: Callable[[], object]) -> bool:
        """Within a sweep: remove what was not held since its begin; whether it was removed."""
        with self._lock:
            if self._noted is None:
                raise RuntimeError("nothing may be removed outside of a sweep")
            if digest in self._noted:
                return False
            remove()
            return True
