"""The header of a file of visible sets, and its blocks, looked for before they are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OutputError, UnreadablePvsError

ALIGNED = 16
"""Every block begins at a multiple of this."""

MOST = 0xFFFFFFFF

BLOCKS = (
    "order", "cells", "grid", "row_of", "row_offsets", "rows", "slices", "altitudes", "names",
)  # fmt: skip
HEADER = np.dtype([
    ("magic", "S8"), ("version", "<u4"), ("flags", "<u4"), ("file_bytes", "<u8"),
    ("objects", "<u4"), ("cells", "<u4"), ("rows", "<u4"), ("method", "<u4"), ("origin", "<f8", 3),
    ("low", "<f4", 3), ("high", "<f4", 3), ("blocks", [(name, "<u4") for name in BLOCKS]),
    ("scene", "V8"), ("settings", "V8"), ("checksum", "<u4"),
])  # fmt: skip


def u32(value: int, what: str) -> int:
    """The number, if the file has room for it.  Raises :class:`OutputError`."""
    if value > MOST:
        raise OutputError(
            f"{value:,} {what} are more than the file has room for",
            where="visible sets",
            remedy="take fewer or larger view cells",
        )
    return value


@dataclass(frozen=True)
class Blocks:
    """The blocks of a file's bytes, each looked for before it is taken."""

    data: bytes
    offsets: np.void
    where: str

    def array(self, name: str, kind: Any, count: int, skip: int = 0) -> NDArray[Any]:
        """``count`` items of a block, behind its first ``skip`` bytes."""
        kind = np.dtype(kind)
        begin = self._begin(name) + skip
        self._check(name, begin, count * kind.itemsize)
        return np.frombuffer(memoryview(self.data)[begin : begin + count * kind.itemsize], kind)

    def raw(self, name: str, count: int, skip: int = 0) -> bytes:
        """``count`` bytes of a block, behind its first ``skip``."""
        begin = self._begin(name) + skip
        self._check(name, begin, count)
        return self.data[begin : begin + count]

    def ascending(self, name: str, count: int, skip: int = 0) -> NDArray[np.int64]:
        """(count + 1,) offsets that begin with 0 and never fall."""
        offsets = self.array(name, "<u4", count + 1, skip).astype(np.int64)
        if offsets[0] != 0 or (np.diff(offsets) < 0).any():
            raise self.damage(f"the offsets of its {name} do not ascend from 0")
        return offsets

    def damage(self, what: str) -> UnreadablePvsError:
        return damage(what, self.where)

    def _begin(self, name: str) -> int:
        return int(self.offsets[name]) * ALIGNED

    def _check(self, name: str, begin: int, length: int) -> None:
        if begin < HEADER.itemsize or begin + length > len(self.data):
            raise self.damage(f"its {name}, {length} bytes at {begin}, are not in the file")


def damage(what: str, where: str) -> UnreadablePvsError:
    """The error of a file that is not as it was written."""
    return UnreadablePvsError(what, where=where, remedy="copy or write it again")
