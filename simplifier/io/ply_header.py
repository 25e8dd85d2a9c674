"""The header of a PLY file: which elements follow, with which properties, in which encoding.

The data of a PLY file as cells at positions: bytes in binary files, numbers in text files.

Both kinds offer the same three calls, so that :mod:`simplifier.io.ply` lays out rows once.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.text import quote_word

# Both sets of names are in use; the value is numpy's type code without the byte order.
SCALAR_TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
    **{"int64": "i8", "uint64": "u8"},
}
ENCODINGS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
LONGEST_HEADER = 1 << 20


@dataclass(frozen=True)
class Property:
    """``kind``: type code of the value or of a list's items; ``count_kind``: empty for a scalar."""

    name: str
    kind: str
    count_kind: str = ""


@dataclass(frozen=True)
class Element:
    name: str
    count: int
    properties: tuple[Property, ...]

    def property(self, *names: str) -> Property | None:
        """The first property that has one of the names."""
        return next((one for one in self.properties if one.name in names), None)


@dataclass(frozen=True)
class PlyHeader:
    """``byte_order``: "<", ">" or "" for text; ``end``: where the data begin."""

    byte_order: str
    elements: tuple[Element, ...]
    end: int


def read_header(data: bytes, where: str) -> PlyHeader:
    """Raises :class:`UnreadableMeshError` with the line that cannot be understood."""
    lines, end = _header_lines(data, where)
    encoding: str | None = None
    elements: list[Element] = []
    properties: list[list[Property]] = []  # of each element
    names: set[str] = set()  # of the last one's properties
    for line in lines[1:]:
        words = line.split()
        if not words or words[0] in (b"comment", b"obj_info"):
            continue
        if words[0] == b"format" and len(words) >= 2 and words[1] in ENCODINGS:
            encoding = ENCODINGS[words[1]]
        elif words[0] == b"element" and len(words) == 3 and words[2].isdigit():
            elements.append(Element(_name(words[1]), _count(words[2], where), ()))
            properties.append([])
            names = set()
        elif words[0] == b"property" and elements:
            last = elements[-1]
            one = _property(line, words, where)
            if one.name in names:
                raise UnreadableMeshError(
                    f"{quote_name(last.name)} has the property {quote_name(one.name)} twice",
                    where=where,
                )
            names.add(one.name)
            properties[-1].append(one)
        elif elements or encoding is None or words[0] in (b"format", b"element", b"property"):
            raise _not_understood(line, where)
        # Else a comment: Blender 2.47 wrote its own without that word, behind the line 'format'.
    if encoding is None:
        raise UnreadableMeshError("the PLY header has no line 'format'", where=where)
    whole = (
        replace(one, properties=tuple(own)) for one, own in zip(elements, properties, strict=True)
    )
    return PlyHeader(encoding, tuple(whole), end)


def check_magic(data: bytes, where: str) -> None:
    """Raises :class:`UnreadableMeshError` unless the first word is ``ply``."""
    if data[:3] != b"ply" or data[3:4] not in (b"\n", b"\r", b" ", b"\t"):
        raise UnreadableMeshError(
            f"not a PLY file: it begins with {quote_word(data[:8])}", where=where
        )


def _header_lines(data: bytes, where: str) -> tuple[list[bytes], int]:
    """The lines before ``end_header`` and the place behind it."""
    check_magic(data, where)
    newline = _newline(data)
    mark = data.find(newline + b"end_header", 0, LONGEST_HEADER)
    end = data.find(newline, mark + len(newline)) if mark >= 0 else -1
    if end < 0:
        raise UnreadableMeshError(
            "the file is truncated inside its header: no line 'end_header'",
            where=where,
            remedy="copy or export it again",
        )
    return data[:mark].split(newline), end + len(newline)


def _newline(data: bytes) -> bytes:
    """How the header ends its lines; the data behind it may hold any byte."""
    first = next((i for i in range(3, min(len(data), 256)) if data[i] in b"\r\n"), 3)
    if data[first : first + 2] == b"\r\n":
        return b"\r\n"
    return data[first : first + 1]


def _count(word: bytes, where: str) -> int:
    if len(word) > 12:
        raise UnreadableMeshError(f"{quote_word(word)} elements cannot be", where=where)
    return int(word)


def _property(line: bytes, words: list[bytes], where: str) -> Property:
    kinds = [SCALAR_TYPES.get(word.decode("latin-1"), "") for word in words]
    if len(words) == 3 and kinds[1]:
        return Property(_name(words[2]), kinds[1])
    if len(words) == 5 and words[1] == b"list" and kinds[2][:1] in ("i", "u") and kinds[3]:
        return Property(_name(words[4]), kinds[3], kinds[2])
    raise _not_understood(line, where)


def _name(word: bytes) -> str:
    return word.decode("latin-1")


def quote_name(name: str) -> str:
    """The name of an element or property as it can be put into a message."""
    return quote_word(name.encode("latin-1"))


def _not_understood(line: bytes, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(
        f"the PLY header line {quote_word(line)} is not understood",
        where=where,
        remedy="the file is damaged or made for another version; export it again",
    )


Positions = range | NDArray[np.int64]


class Body(Protocol):
    """Cells from position 0 to ``length``."""

    @property
    def length(self) -> int: ...

    def size(self, kind: str) -> int:
        """Cells that a value of the type takes."""

    @property
    def big_endian(self) -> bool: ...

    def integer(self, kind: str, position: int) -> int:
        """The value at a position as a whole number, -1 when it is none."""

    def whole_cells(self) -> NDArray[Any]:
        """The cells as ``kernels.lists.walk_rows`` takes them; -1 for what is no whole number."""

    def gather(self, kind: str, positions: Positions, width: int) -> NDArray[Any]:
        """(len(positions), width): that many values in a row from each position on."""


@dataclass(frozen=True)
class BinaryBody:
    data: bytes
    byte_order: str
    cells: NDArray[np.uint8] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", np.frombuffer(self.data, dtype=np.uint8))

    @property
    def length(self) -> int:
        return len(self.data)

    @property
    def big_endian(self) -> bool:
        return self.byte_order == ">"

    def size(self, kind: str) -> int:
        return int(kind[1])

    def integer(self, kind: str, position: int) -> int:
        cells = self.data[position : position + int(kind[1])]
        return int.from_bytes(cells, "big" if self.big_endian else "little", signed=kind[0] == "i")

    def whole_cells(self) -> NDArray[np.uint8]:
        return self.cells

    def gather(self, kind: str, positions: Positions, width: int) -> NDArray[Any]:
        dtype = np.dtype(self.byte_order + kind)
        if isinstance(positions, range):
            return np.ndarray(
                (len(positions), width),
                dtype,
                self.data,
                offset=positions.start if len(positions) else 0,
                strides=(positions.step, dtype.itemsize),
            )
        cells = self.cells[positions[:, None] + np.arange(width * dtype.itemsize)]
        return np.asarray(cells.view(dtype))


@dataclass(frozen=True, eq=False)
class TextBody:
    numbers: FloatArray

    @property
    def length(self) -> int:
        return len(self.numbers)

    @property
    def big_endian(self) -> bool:
        return False

    def size(self, kind: str) -> int:
        return 1

    def integer(self, kind: str, position: int) -> int:
        value = float(self.numbers[position])
        return int(value) if value.is_integer() else -1

    def whole_cells(self) -> NDArray[np.int64]:
        whole = (np.abs(self.numbers) < 2**53) & (self.numbers == np.floor(self.numbers))
        return np.where(whole, self.numbers, -1.0).astype(np.int64)

    def gather(self, kind: str, positions: Positions, width: int) -> NDArray[Any]:
        if isinstance(positions, range):
            positions = np.arange(positions.start, positions.stop, positions.step)
        return np.asarray(self.numbers[positions[:, None] + np.arange(width)])
