"""What engines, routes and webhooks need of storage: jobs and blobs.

Every method is one transaction, safe to call from any thread, and raises
:class:`~service.errors.DiskFullError` or :class:`~service.errors.DatabaseDamagedError` when the
database can no longer be written or read.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Protocol

from service.jobs.job import (
    Blob,
    Claim,
    Failure,
    Job,
    JobFile,
    JobKind,
    JobState,
    Submission,
    Summary,
)

LONGEST_URL = 2000
"""Characters of a webhook's address."""

FOLDERS = 256
"""Blobs are looked through in as many parts, by the first byte of their digest."""


@dataclass(frozen=True)
class JobFilter:
    """Which jobs to list: all that are given must hold; times are Unix seconds."""

    states: frozenset[JobState] = frozenset()
    kinds: frozenset[JobKind] = frozenset()
    asset_id: str | None = None
    created_from: float | None = None
    created_before: float | None = None


@dataclass(frozen=True)
class JobPage:
    """Jobs, newest first, and the cursor of the next page; None on the last."""

    jobs: tuple[Job, ...]
    cursor: int | None


class JobStore(Protocol):
    """Jobs and their files."""

    def submit(self, submission: Submission, queue_limit: int) -> tuple[Job, bool]:
        """Take a job in; whether it is to be done.

        Else it has succeeded at once, with the same files, since a result of the same work is
        stored for the same tenant, with all of its files.  Its asset is made when there is none.
        Raises :class:`~service.errors.QueueFullError` where as many wait as may, of all tenants or
        of this one; one of whom nothing waits is never refused.
        """

    def stored_result(self, submission: Submission) -> tuple[JobFile, ...]:
        """The files that :meth:`submit` would give it now; none where the work has to be done."""

    def check_room(self, tenant: str, queue_limit: int) -> None:
        """Refuse now what :meth:`submit` would refuse after an upload, as far as that is known.

        Raises :class:`~service.errors.QueueFullError`.
        """

    def job(self, tenant: str | None, job_id: str) -> Job:
        """Raises :class:`~service.errors.NotFoundError`; a tenant of None sees all."""

    def jobs(
        self, tenant: str | None, wanted: JobFilter, *, before: int | None, limit: int
    ) -> JobPage: ...

    def queue(self, tenant: str | None, limit: int) -> tuple[tuple[int, Job], ...]:
        """Queued jobs, the next first, each with its place from 1 among those of all tenants.

        Places are those of :func:`service.jobs.turns.place`, if no more came.
        """

    def place(self, number: int) -> int | None:
        """The place of a job in the queue, as :meth:`queue` has it.

        None where it does not wait, or behind ten thousand others of its tenant.
        """

    def files(self, job_id: str) -> tuple[JobFile, ...]:
        """The files of a job, what was sent and what was made, by name."""

    def expire(self, ended_before: float) -> int:
        """Forget jobs that ended before then, except the latest run of each asset; how many."""

    def unnamed(self, digests: Collection[str]) -> set[str]:
        """Those of up to some thousand digests that no file of any job has."""

    def cancel(self, tenant: str | None, job_id: str) -> Job:
        """End a queued job; ask for the end of a running one.

        Raises :class:`~service.errors.NotFoundError`, and :class:`~service.errors.ConflictError`
        when it has ended.
        """

    def counts(self) -> Mapping[JobState, int]: ...

    def oldest_queued(self) -> float | None:
        """When the oldest job that waits was submitted, Unix seconds; None where none does."""

    # What engines call.

    def claim(self, owner: str, lease_seconds: float) -> Claim | None:
        """Begin an attempt of the job whose turn it is; see :mod:`service.jobs.turns`.

        None where no job waits, all that wait have a pause, or their tenants have as many running
        as they may.
        """

    def renew(self, claims: Collection[Claim], lease_seconds: float) -> Mapping[str, bool]:
        """Whether their end was asked for, by job id, of those claims that are still held."""

    def cancelled(self, claims: Collection[Claim]) -> frozenset[str]:
        """The ids of those claims' jobs whose end was asked for; this only reads."""

    def succeed(self, claim: Claim, files: Sequence[JobFile], summary: Summary) -> bool:
        """Whether the claim still held; if not, nothing has changed."""

    def fail(self, claim: Claim, failure: Failure, *, final: bool) -> JobState | None:
        """End the job, or queue it again where ``final`` is false and attempts are left.

        It is begun again after a pause, which grows with its attempts.
        Where its end was asked for and ``final`` is false, it ends cancelled.

        The state that it has now; None when the claim no longer held.
        """

    def put_off(self, claim: Claim, failure: Failure) -> JobState | None:
        """Queue the job again where this machine had no room for it, as :meth:`release` does.

        It is begun again after a pause, and fails after ten attempts.  The state that it has now;
        None when the claim no longer held.
        """

    def end_cancelled(self, claim: Claim) -> bool:
        """Whether the claim still held."""

    def add_files(self, job_id: str, files: Sequence[JobFile]) -> bool:
        """Add files to a job that has succeeded; whether it is still there.

        Those that it has by the same names stay.
        """

    def release(self, claim: Claim) -> bool:
        """Queue the job again where its attempt is not to count; whether the claim still held.

        ``attempts`` rises by one in place of ``attempt`` falling, so that the fence stays one.  A
        job whose end was asked for is cancelled instead.
        """

    def recover(self, failure: Failure, *, all_leases: bool) -> Sequence[Job]:
        """Take back running jobs whose lease has run out (or all), as :meth:`fail` does.

        ``all_leases`` is for the start of a server that shares its database with no other; pauses
        are over then as well.
        """


class Keeping(Protocol):
    """A block within which nothing that was put or found is swept away, until rows name it.

    What is put takes the place of an equal blob, whose bytes may have rotted.
    All methods are safe from any thread until the block ends.
    """

    def put(self, source: BinaryIO) -> Blob:
        """Store bytes, hashed as they are read.  Raises :class:`~service.errors.DiskFullError`."""

    def put_file(self, path: Path) -> Blob:
        """Store a file of the same disk by moving it."""

    async def put_stream(self, chunks: AsyncIterator[bytes]) -> Blob:
        """Store an upload as it comes, never holding more than a chunk; its errors pass through."""

    def adopt(self, blob: Blob) -> None:
        """Keep what is stored already.  Raises KeyError when it is not."""


class DamagedBlobError(Exception):
    """The bytes of a blob are no longer those that were stored; by now it is stored no more."""


class BlobState(StrEnum):
    """What reading a blob has shown."""

    WHOLE = "whole"
    DAMAGED = "damaged"
    GONE = "gone"


class Reader(Protocol):
    """Bytes of a blob as they are read, for one thread at a time; to be closed, by ``with``."""

    def __enter__(self) -> Reader: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def close(self) -> None: ...

    def read(self, size: int = -1) -> bytes:
        """The next ``size`` bytes, or all; none at the end.

        The last of them are given once the digest of the whole blob was found right.  Else raises
        :class:`DamagedBlobError`.
        """


class BlobStore(Protocol):
    """Bytes by their SHA-256.  All methods are safe from any thread.

    Raises :class:`~service.errors.NotReadyError` where the store cannot be reached.
    """

    def keeping(self) -> AbstractContextManager[Keeping]: ...

    def open(self, blob: Blob, start: int = 0, stop: int | None = None) -> Reader:
        """Its bytes, or those from ``start`` to before ``stop``.  Raises KeyError when it is not
        there."""

    def has(self, blob: Blob) -> bool:
        """Whether it is there, as far as can be told without reading it."""

    def lay_out(self, blob: Blob, place: Path) -> None:
        """Make a file for another process of this machine to read, where there is none.

        Its bytes are not looked at; who reads it has to.  Raises KeyError, and
        :class:`~service.errors.DiskFullError`.
        """

    def signed_url(self, blob: Blob, media_type: str, disposition: str) -> str | None:
        """An address from which anybody may get it for a quarter of an hour, unchecked; None where
        there is none.  Raises KeyError.

        ``media_type``, ``disposition``  what the answer's headers are to say.
        """

    def check(self, blob: Blob) -> bool:
        """Read all of it; whether it is there and right.  It is stored no more where it is not."""

    def is_right(self, blob: Blob) -> bool:
        """As :meth:`check`, but what was found right a short while ago is not read again."""

    @property
    def broken_reads(self) -> int:
        """How often what was read for somebody turned out to be damaged, since the start."""

    @property
    def corrupt(self) -> int:
        """Blobs that are stored no more since they were damaged, until they come again."""

    def digests(self) -> Iterator[str]:
        """The digests of all that is stored, in no order."""

    def sweep(self, unnamed: Callable[[Collection[str]], Collection[str]]) -> int:
        """Remove what is neither named nor kept; how many.

        ``unnamed`` tells which of some digests no row names, and is called with a batch at a time,
        so that a sweep takes no memory however large the store is.  By then the store notes what is
        put or adopted: whatever was committed before is named, and whatever comes later is noted.
        So nothing that a row names can go, whatever the clock does.
        """

    def free_bytes(self) -> int:
        """What the disk of this machine has left for it."""

    def problem(self) -> str | None:
        """Why it cannot be used at the moment, in words; None where it can."""


class BlobInventory(Protocol):
    """All blobs of a store, to be read anew and put right; beside whoever else uses it."""

    def digests(self) -> Iterator[str]:
        """Of all that is stored, in no order."""

    def digests_in(self, first: int) -> Iterator[str]:
        """Those that begin with a byte."""

    def digests_aside(self) -> Sequence[str]:
        """Of what was put aside."""

    def examine(
        self, digest: str, on_read: Callable[[int], object] = ..., *, aside: bool
    ) -> BlobState:
        """Read a blob.

        ``on_read``  is told how many bytes were read, now and then; what it raises passes through.
        ``aside``    whether it is stored no more where it is damaged, but put aside, or gone.
        """

    def examine_aside(self, digest: str) -> BlobState:
        """Read one that was put aside, which changes nothing."""

    def put_back(self, digest: str) -> None:
        """Have one that was put aside stored again: its bytes turned out to be right."""

    def restore(self, digest: str, source: BinaryIO) -> bool:
        """Store what a copy has of a blob, if its bytes are right; whether they were."""


@dataclass(frozen=True)
class ScrubFigures:
    """What reading all blobs anew has shown since the start.

    ``checked``     blobs that were read; ``size`` bytes of these.
    ``damaged``     blobs that were found damaged.
    ``lost``        blobs that are gone and that jobs name, when it was last looked for them.
    ``oldest_age``  seconds since the oldest check; None where nothing is checked.
    """

    checked: int = 0
    size: int = 0
    damaged: int = 0
    lost: int = 0
    oldest_age: float | None = None


class Scrub(Protocol):
    """Reads all blobs anew, now and then."""

    def figures(self) -> ScrubFigures: ...
