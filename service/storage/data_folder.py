"""The one folder that a server keeps everything in, and the lock that makes it the only one."""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from service.errors import SettingsError
from service.jobs.job import JOURNALS
from service.storage.sqlite import SqliteDatabase

_JOURNAL_SECONDS = 7 * 86_400.0


class FolderInUseError(SettingsError):
    """Another process has the folder."""


@dataclass(frozen=True)
class DataFolder:
    """What lies where.

    ``occluder.db``  the database, with its log beside it.
    ``blobs/``       meshes and results, unless they are in a bucket.
    ``cache/``       copies of what is in the bucket.
    ``scratch/``     work under way, of no use to another server.
    ``journals/``    what jobs under way have measured, which outlives attempts and servers.
    ``lock``         held by the server, with its process id.
    """

    path: Path

    @property
    def database(self) -> Path:
        return self.path / "occluder.db"

    @property
    def blobs(self) -> Path:
        return self.path / "blobs"

    @property
    def cache(self) -> Path:
        return self.path / "cache"

    @property
    def scratch(self) -> Path:
        return self.path / "scratch"

    @property
    def lock(self) -> Path:
        return self.path / "lock"

    def make(self) -> None:
        """Make the folders that are not there, for nobody else to look into.

        Raises :class:`SettingsError` where one cannot be made or written to.
        """
        with self._raising_settings_error():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            for folder in (self.path, self.blobs, self.scratch):
                folder.mkdir(mode=0o700, exist_ok=True)
                if not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
                    raise PermissionError(0, "no right to write")

    def open_database(self) -> SqliteDatabase:
        """Made where it is not there, unless blobs are: an empty one would have them swept away.

        Raises as :meth:`~service.storage.sqlite.SqliteDatabase.open` does.
        """
        has_blobs = next(self.blobs.glob("??/*"), None) is not None
        return SqliteDatabase.open(self.database, may_be_new=not has_blobs)

    @contextmanager
    def own(self) -> Iterator[None]:
        """Make the folder and keep other servers out of it; scratch is empty then.

        The lock ends with the process, however that ends, and is not handed to its children.
        Raises :class:`FolderInUseError` where another server runs, and :class:`SettingsError` where
        the folder cannot be used.
        """
        self.make()
        with self._raising_settings_error():
            lock = self.lock.open("ab", buffering=0)  # so that closing it writes nothing
        with lock:
            with self._raising_settings_error():
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    raise self._in_use_error() from None
                lock.truncate(0)
                lock.write(f"{os.getpid()}\n".encode())
                _empty(self.scratch)
                _drop_old(self.path / JOURNALS)
            try:
                yield
            finally:
                lock.truncate(0)

    def _in_use_error(self) -> FolderInUseError:
        pid = self.lock.read_text().strip()
        return FolderInUseError(
            f"the data folder '{self.path}' is used by another server"
            f"{f' (process {pid})' if pid else ''}; "
            "stop that one, or set OCCLUDER_DATA to another folder"
        )

    @contextmanager
    def _raising_settings_error(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise SettingsError(
                f"the data folder '{self.path}' cannot be used ({error.strerror}: "
                f"'{error.filename or self.path}'); check its permissions and the free space, or "
                "set OCCLUDER_DATA to another folder"
            ) from error


def _drop_old(folder: Path) -> None:
    """Journals of jobs that have ended elsewhere, or were cancelled while no server ran."""
    for entry in folder.glob("*"):
        if entry.stat().st_mtime < time.time() - _JOURNAL_SECONDS:
            entry.unlink()


def _empty(folder: Path) -> None:
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()
