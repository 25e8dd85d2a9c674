"""SHA-256 of files, many at a time, of which those that nobody wrote are not read again."""

from __future__ import annotations

import hashlib
import os
import re
import stat
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

_AnyPath = TypeVar("_AnyPath", str, Path)

Stamp = tuple[int, int, int, int]
"""Of a file: when its bytes and when anything of it changed, in ns, its size, and its inode."""

_POINTER = re.compile(
    rb"version https://git-lfs\.github\.com/spec/v1\noid sha256:([0-9a-f]{64})\nsize [0-9]+\n"
)
_LONGEST_POINTER = 200  # bytes
_SETTLED = 2_000_000_000  # ns: a file that changed just now may do so again at the same moment


class Digests:
    """Of each file the digest in hex, read again only when its :data:`Stamp` is another one.

    A pointer of Git LFS counts as the file that it stands for, so that a check need not fetch it.
    Safe from any thread.
    """

    def __init__(self) -> None:
        self._known: dict[str, tuple[Stamp, str]] = {}

    def of(self, path: str | Path) -> str | None:
        """None where no file can be read; a device or a pipe, which might never end, is none."""
        name = os.fspath(path)
        try:
            found = os.stat(name)  # noqa: PTH116  a Path takes longer to make
            if not stat.S_ISREG(found.st_mode):
                return None
            stamp = (found.st_mtime_ns, found.st_ctime_ns, found.st_size, found.st_ino)
            known = self._known.get(name)
            if known is not None and known[0] == stamp:
                return known[1]
            digest = _pointed_at(name, found.st_size) or _digest(name)
        except (OSError, ValueError):  # ValueError: a NUL character in the name
            return None
        if time.time_ns() - max(stamp[:2]) > _SETTLED:
            self._known[name] = stamp, digest
        return digest

    def all_of(self, paths: Iterable[_AnyPath], threads: int) -> dict[_AnyPath, str | None]:
        """Of each file by its path, on several threads."""
        wanted = list(dict.fromkeys(paths))
        with ThreadPoolExecutor(threads) as pool:
            parts = pool.map(lambda part: [self.of(path) for path in part], _parts(wanted, threads))
            return dict(zip(wanted, (digest for part in parts for digest in part), strict=True))

    def stamps(self, paths: Iterable[str]) -> dict[str, Stamp]:
        """By path, of those that need not be read again."""
        return {path: self._known[path][0] for path in paths if path in self._known}

    def remember(self, digests: Mapping[str, str], stamps: Mapping[str, Sequence[int]]) -> None:
        """What :meth:`all_of` and :meth:`stamps` gave in an earlier run.

        Raises ValueError, TypeError, KeyError or AttributeError where these are not such.
        """
        for name, (modified, changed, size, inode) in stamps.items():
            self._known[name] = (modified, changed, size, inode), digests[name]


def _digest(path: str) -> str:
    with Path(path).open("rb", buffering=0) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _pointed_at(path: str, size: int) -> str | None:
    found = _POINTER.fullmatch(Path(path).read_bytes()) if size <= _LONGEST_POINTER else None
    return found[1].decode() if found else None


def _parts(paths: list[_AnyPath], count: int) -> list[list[_AnyPath]]:
    """In order, a part a thread: to hand over each file by itself takes longer than to read it."""
    edges = [len(paths) * i // count for i in range(count + 1)]
    return [paths[begin:end] for begin, end in pairwise(edges)]
