"""The blocks of a binary file, looked for before they are read."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import OccluderError, OutputError

ALIGNED = 16
"""Every block begins at a multiple of this."""

MOST = 0xFFFFFFFF


def checksum(data: bytes, header: int) -> int:
    """CRC-32 of a file with 0 in place of the last four bytes of its header, where it is kept."""
    whole = memoryview(data)
    return zlib.crc32(whole[header:], zlib.crc32(bytes(4), zlib.crc32(whole[: header - 4])))


def sealed(
    header: NDArray[Any], blocks: Mapping[str, bytes], fitting: Callable[[int, str], int]
) -> bytes:
    """The bytes of a file: its header, and behind it the blocks, each from a multiple of 16 on.

    ``header``   () of a structure with ``blocks``, ``file_bytes`` and, at its end, ``checksum``,
                 which are set.
    ``fitting``  gives back a number of something that has a name, or refuses it.
    """
    parts, end = [b""], header.itemsize
    for name, block in blocks.items():
        header["blocks"][name] = fitting(end // ALIGNED, "blocks")
        parts.append(block.ljust(-(-len(block) // ALIGNED) * ALIGNED, b"\0"))
        end += len(parts[-1])
    header["file_bytes"] = end
    parts[0] = header.tobytes()
    header["checksum"] = checksum(b"".join(parts), header.itemsize)
    parts[0] = header.tobytes()
    return b"".join(parts)


def check_sealed(header: np.void, data: bytes, damage: Callable[[str], OccluderError]) -> None:
    """Raises what ``damage`` makes where the bytes are not those that :func:`sealed` gave."""
    if header["file_bytes"] != len(data):
        raise damage(f"it should have {header['file_bytes']} bytes and has {len(data)}")
    if checksum(data, header.itemsize) != header["checksum"]:
        raise damage("its bytes are not those that were written: the checksum is another")


def fitting(value: int, what: str, *, where: str, remedy: str) -> int:
    """The number, if a file has room for it.  Raises :class:`OutputError`."""
    if value > MOST:
        raise OutputError(
            f"{value:,} {what} are more than the file has room for", where=where, remedy=remedy
        )
    return value


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
