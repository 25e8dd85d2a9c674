"""The blocks of a binary file, looked for before they are read."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OccluderError

ALIGNED = 16
"""Every block begins at a multiple of this."""

MOST = 0xFFFFFFFF


def checksum(data: bytes, header: int) -> int:
    """CRC-32 of a file with 0 in place of the last four bytes of its header, where it is kept."""
    whole = memoryview(data)
    return zlib.crc32(whole[header:], zlib.crc32(bytes(4), zlib.crc32(whole[: header - 4])))


def padded(block: bytes) -> bytes:
    """With 0 up to where the next block begins."""
    return block.ljust(-(-len(block) // ALIGNED) * ALIGNED, b"\0")


@dataclass(frozen=True)
class Blocks:
    """The blocks of a file's bytes, each looked for before it is taken.

    ``offsets``  where each begins, by name, in units of :data:`ALIGNED` bytes.
    ``first``    bytes of the header, which no block reaches into.
    ``damage``   makes the error of a file that is not as it was written from what is wrong.
    """

    data: bytes
    offsets: np.void
    first: int
    damage: Callable[[str], OccluderError]

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

    def _begin(self, name: str) -> int:
        return int(self.offsets[name]) * ALIGNED

    def _check(self, name: str, begin: int, length: int) -> None:
        if begin < self.first or begin + length > len(self.data):
            raise self.damage(f"its {name}, {length} bytes at {begin}, are not in the file")
