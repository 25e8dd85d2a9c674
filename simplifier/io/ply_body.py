"""The data of a PLY file as cells at positions: bytes in binary files, numbers in text files.

Both kinds offer the same three calls, so that the rows (``ply_rows.py``) are laid out once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

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
