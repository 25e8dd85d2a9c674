"""Who builds in a folder: one whole build or join, or any number of shards, each once.

By locks of files, which hold among the machines of a shared folder, too: NFS passes on those of
files that are open for writing, flock(2), which a folder never is.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from simplifier.builds.shards import Shard
from simplifier.errors import OutputError

try:
    import fcntl
except ImportError:  # Windows: builds are not kept apart there
    fcntl = None  # type: ignore[assignment]

_FOLDER = ".occluder-build.lock"
_SHARD = ".occluder-shard-{number}-of-{count}.lock"
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP}
"""What file systems without locks say."""


@contextmanager
def whole_build(folder: Path) -> Iterator[None]:
    """Hold the folder until the block ends, or the process in whatever way.

    Raises :class:`OutputError` at once where another process holds it, or a shard of it.
    """
    with _held(folder, _FOLDER, exclusive=True, busy="another build of this folder is running"):
        yield


@contextmanager
def shard_build(folder: Path, shard: Shard) -> Iterator[None]:
    """Hold a shard of the folder, as :func:`whole_build` does; other shards may be held meanwhile.

    The lock that shards share stays as an empty file until the next whole build or join.
    """
    name = _SHARD.format(number=shard.number, count=shard.count)
    twice = f"another build of shard {shard} of this folder is running"
    with (
        _held(folder, _FOLDER, exclusive=False, busy="a whole build of this folder is running"),
        _held(folder, name, exclusive=True, busy=twice),
    ):
        yield


@contextmanager
def _held(folder: Path, name: str, *, exclusive: bool, busy: str) -> Iterator[None]:
    if fcntl is None:
        yield
        return
    path = folder / name
    held = _lock(path, exclusive, busy)
    try:
        yield
    finally:
        if exclusive:  # nobody else has it, and whoever waits to open it looks again
            with suppress(OSError):
                path.unlink()
        os.close(held)


def _lock(path: Path, exclusive: bool, busy: str) -> int:
    """The descriptor of the locked file."""
    while True:
        try:
            held = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise OutputError(
                f"the folder cannot be written to ({error.strerror})",
                where=str(path.parent),
                remedy="check the path and its permissions",
            ) from None
        try:
            fcntl.flock(held, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
            if _is_there(held, path):
                return held
        except BlockingIOError:
            os.close(held)
            raise OutputError(
                busy, where=str(path.parent), remedy="wait for its end, or end it"
            ) from None
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return held
            os.close(held)
            raise
        os.close(held)  # its last holder has removed it meanwhile


def _is_there(held: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(held), path.stat())
    except FileNotFoundError:
        return False
