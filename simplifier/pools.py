"""Jobs of a run, done by a pool: by processes of this machine, or by the machines of a cluster.

What crosses between a run and its workers is plain.  A run sends the name of a function of this
library, settings and jobs as bytes, and arrays; workers answer with bytes, which the run reads as
it reads a file from elsewhere, and files are written by the run alone.  So a pool has to know
nothing of occluders, and a worker needs neither the run's files nor its paths.

A package above this one adds pools by an entry point of the group :data:`POOL_GROUP`, whose object
is called without arguments and returns a context manager of a :class:`Pool`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import check_kind
from simplifier.errors import OptionError, OutputError
from simplifier.processes import (
    ATTEMPTS,
    DIED,
    Answer,
    Attempt,
    JobOutcome,
    answer_of,
    run_jobs,
)
from simplifier.progress import Cancel

__all__ = [
    "ATTEMPTS", "DIED", "POOL_GROUP", "Answer", "Array", "Arrived", "Attempt", "Cancel",
    "JobOutcome", "LocalPool", "Pool", "PoolJob", "Shared", "StartWork", "Work", "answer_of",
    "joined", "pool_named", "start_work",
]  # fmt: skip

POOL_GROUP = "occluder.pools"
_SETTINGS = "settings"  # a file beside those of the arrays

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Shared:
    """What all jobs of a run need; it goes to each machine once, however many jobs that does.

    ``settings``  bytes, of whatever form the work reads.
    ``arrays``    by name, each in pieces that are joined along their first axis where they arrive:
                  a scene's meshes would otherwise be in memory twice.
    """

    settings: bytes
    arrays: Mapping[str, Sequence[Array]]

    @property
    def nbytes(self) -> int:
        """Bytes of the arrays and the settings."""
        pieces = (piece.nbytes for array in self.arrays.values() for piece in array)
        return len(self.settings) + sum(pieces)


@dataclass(frozen=True, eq=False)
class Arrived:
    """The same in a worker, each array whole; they may be read, and must not be written."""

    settings: bytes
    arrays: Mapping[str, Array]


@dataclass(frozen=True)
class PoolJob:
    """``data`` as the work reads it; ``need``, bytes of memory that it takes beside what is shared,
    by which pools place it."""

    data: bytes
    need: int = 0


Work = Callable[[bytes], bytes]
StartWork = Callable[[Arrived], Work]


class Pool(Protocol):
    """Whatever does jobs.

    ``where``  that is, as the end of a sentence: "on 2 machines of 64 processors, by ray".
    """

    @property
    def where(self) -> str: ...

    def run_jobs(
        self, work: str, shared: Shared, jobs: Sequence[PoolJob], cancel: Cancel | None = None
    ) -> Generator[JobOutcome, None, None]:
        """Do every job; yield each outcome as it comes, in any order, with bytes for its result.

        ``work``  names a :data:`StartWork`, as ``"simplifier.module:function"``; it is called
        once in each process.  A worker that dies costs one attempt of the job that it
        was at, and the job is given to another, once.  When ``cancel`` is set, or the caller closes
        the generator, what is under way is ended and lost.

        Raises :class:`~simplifier.errors.BackendUnavailableError` when no job can be done, and
        :class:`~simplifier.errors.OutputError` when what is shared cannot be handed over.
        """


def start_work(name: str, arrived: Arrived) -> Work:
    """What does jobs in a worker, by the name that the run has for it."""
    module, _, function = name.partition(":")
    start = cast(StartWork, getattr(import_module(module), function))
    return start(arrived)


@dataclass(frozen=True)
class LocalPool:
    """Some processes of this machine; what is shared goes through files that all map."""

    processes: int

    @property
    def where(self) -> str:
        return f"in {self.processes} processes of this machine"

    def run_jobs(
        self, work: str, shared: Shared, jobs: Sequence[PoolJob], cancel: Cancel | None = None
    ) -> Generator[JobOutcome, None, None]:
        with tempfile.TemporaryDirectory(prefix="occluder-") as folder:
            _write(shared, Path(folder))
            datas = [job.data for job in jobs]
            yield from run_jobs(_start, (work, folder), datas, self.processes, cancel)


def _start(work: str, folder: str) -> Work:
    """What a process does with a job."""
    place = Path(folder)
    arrays = {file.stem: np.load(file, mmap_mode="r") for file in place.glob("*.npy")}
    arrived = Arrived(
        (place / _SETTINGS).read_bytes(),
        {name: np.asarray(array) for name, array in arrays.items()},
    )
    return start_work(work, arrived)


def _write(shared: Shared, folder: Path) -> None:
    """Raises :class:`OutputError`."""
    try:
        (folder / _SETTINGS).write_bytes(shared.settings)
        for name, pieces in shared.arrays.items():
            _write_joined(folder / f"{name}.npy", pieces)
    except OSError as error:
        raise OutputError(
            f"the work cannot be handed to other processes ({error.strerror})",
            where=str(folder),
            remedy="free some space, set TMPDIR to another folder, or OCCLUDER_THREADS=1",
        ) from None


def _write_joined(path: Path, pieces: Sequence[Array]) -> None:
    length = sum(map(len, pieces))
    shape = (length, *pieces[0].shape[1:])
    if length == 0:  # which cannot be mapped
        np.save(path, np.empty(shape, pieces[0].dtype))
        return
    with path.open("wb") as file:
        header = np.lib.format.header_data_from_array_1_0(pieces[0]) | {
            "shape": shape, "fortran_order": False,
        }  # fmt: skip
        np.lib.format.write_array_header_2_0(file, header)
        for piece in pieces:
            file.write(np.ascontiguousarray(piece).data)


def joined(pieces: Sequence[Array]) -> Array:
    """An array whole, without a copy where it is in one piece."""
    return pieces[0] if len(pieces) == 1 else np.concatenate(pieces)


def pool_named(name: str | None) -> AbstractContextManager[Pool | None]:
    """A pool beside this machine; None for none.

    Raises :class:`OptionError` for one that is not installed, and once it is entered for one that
    cannot be reached.
    """
    if name is None:
        return nullcontext()
    from importlib.metadata import entry_points  # which takes a while to load

    check_kind("pool", name, str, "its name, or None for this machine alone")
    known = {one.name: one for one in entry_points(group=POOL_GROUP)}
    if name not in known:
        raise OptionError(
            f"there is no pool '{name}'",
            where="pool",
            remedy=f"choose {' or '.join(sorted(known))}, or leave it out for this machine alone"
            if known
            else "run: pip install 'planar-occluder[ray]'",
        )
    try:
        made = known[name].load()
    except ImportError as error:
        raise OptionError(
            f"'{name}' lacks a package ({error})",
            where="pool",
            remedy=f"run: pip install 'planar-occluder[{name}]'",
        ) from None
    opened: AbstractContextManager[Pool] = made()
    return opened
