"""SHA-256 of files, many at a time."""

from __future__ import annotations

import hashlib
import re
import time
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

_POINTER = re.compile(
    rb"version https://git-lfs\.github\.com/spec/v1\noid sha256:([0-9a-f]{64})\nsize [0-9]+\n"
)
_LONGEST_POINTER = 200  # bytes
_SETTLED = 2_000_000_000  # ns: a file that changed just now may do so again at the same moment


class Digests:
    """Of each file the digest in hex, read again only when its time or size is another one.

    A pointer of Git LFS counts as the file that it stands for, so that a check need not fetch it.
    For one run, or for one that watches; safe from any thread.
    """

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int, int], str]] = {}

    def of(self, path: Path) -> str | None:
        """None where there is no file that can be read."""
        try:
            stat = path.stat()
            stamp = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
            known = self._known.get(path)
            if known is not None and known[0] == stamp:
                return known[1]
            digest = _pointed_at(path, stat.st_size) or _digest(path)
        except (OSError, ValueError):  # ValueError: a NUL character in the name
            return None
        if time.time_ns() - stat.st_mtime_ns > _SETTLED:
            self._known[path] = stamp, digest
        return digest

    def all_of(self, paths: Iterable[Path], threads: int) -> Mapping[Path, str | None]:
        """Of each file, on several threads."""
        wanted = list(dict.fromkeys(paths))
        with ThreadPoolExecutor(threads) as pool:
            parts = pool.map(lambda part: [self.of(path) for path in part], _parts(wanted, threads))
            return dict(zip(wanted, (digest for part in parts for digest in part), strict=True))


def _digest(path: Path) -> str:
    with path.open("rb", buffering=0) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _pointed_at(path: Path, size: int) -> str | None:
    found = _POINTER.fullmatch(path.read_bytes()) if size <= _LONGEST_POINTER else None
    return found[1].decode() if found else None


def _parts(paths: list[Path], count: int) -> list[list[Path]]:
    """In order, a part a thread: to hand over each file by itself takes longer than to read it."""
    edges = [len(paths) * i // count for i in range(count + 1)]
    return [paths[begin:end] for begin, end in pairwise(edges)]
