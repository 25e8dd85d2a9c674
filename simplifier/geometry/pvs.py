"""Pvs: which objects of a scene are potentially visible from each view cell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.errors import OptionError
from simplifier.geometry.arrays import vector
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.scene import axis_order
from simplifier.geometry.solid import BoolArray
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.simplify import Axis

UNKNOWN = -1
"""In place of a row: the cell is not computed, and everything counts as visible from it."""

METHODS = ("cull-map", "slice-wise", "voxel-column", "strong-occluders")
"""What can find the sets; files hold a method's place in this."""

_BATCH = 1 << 20  # bytes of runs that are checked at once, each as a number of 8 bytes


@dataclass(frozen=True, eq=False)
class Rows:
    """Sets of objects, each once, as lengths of runs.

    ``data``     the runs of one row after the other, LEB128; the first counts hidden objects, the
                 second visible ones, and so on; what is behind the last run is hidden.
    ``offsets``  (r + 1,) int64: where each row begins in ``data``, and the end.
    """

    data: bytes
    offsets: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def row(self, index: int, count: int) -> BoolArray:
        """(count,) what is in the set."""
        raw = np.frombuffer(self.data, np.uint8)[self.offsets[index] : self.offsets[index + 1]]
        ends = np.minimum(np.cumsum(_lengths(raw)), count)
        steps = np.zeros(count + 1, dtype=np.int8)
        np.add.at(steps, ends[:-1:2], 1)  # without a run of hidden objects at the end
        np.add.at(steps, ends[1::2], -1)
        return np.asarray(np.cumsum(steps[:count]) > 0)

    def check(self, count: int) -> None:
        """Raise ValueError where a row is not one of ``count`` objects.

        No run but the first is empty, so walking a row takes no longer than ``count`` steps.
        """
        begin = 0
        while begin < len(self):
            stop = self.offsets[begin] + _BATCH
            end = max(begin + 1, int(np.searchsorted(self.offsets, stop, "right")) - 1)
            self._check_some(begin, min(end, len(self)), count)
            begin = end

    def _check_some(self, begin: int, end: int, count: int) -> None:
        offsets = self.offsets[begin : end + 1] - self.offsets[begin]
        raw = np.frombuffer(self.data, np.uint8)[self.offsets[begin] : self.offsets[end]]
        offsets = offsets[np.diff(offsets, prepend=-1) > 0]  # without empty rows
        if (raw[offsets[1:] - 1] >= 0x80).any():
            raise ValueError("the last number goes on")
        lengths = _lengths(raw)
        firsts = np.searchsorted(np.flatnonzero(raw < 0x80), offsets)
        if (lengths > count).any():  # sums of such might not fit 64 bits
            raise ValueError(f"a run is longer than the {count} objects")
        if (np.diff(np.concatenate([[0], np.cumsum(lengths)])[firsts]) > count).any():
            raise ValueError(f"the runs of a row are longer than the {count} objects")
        empty = lengths == 0
        empty[firsts[:-1]] = False
        if empty.any():
            raise ValueError("a run is empty")


def pack_rows(sets: Iterable[BoolArray]) -> tuple[Rows, NDArray[np.int64]]:
    """The rows of some sets (n,), equal ones once, and (k,) int64: which is whose."""
    known: dict[bytes, int] = {}
    places = [known.setdefault(_packed(each), len(known)) for each in sets]
    offsets = np.cumsum([0, *map(len, known)], dtype=np.int64)
    return Rows(b"".join(known), offsets), np.array(places, dtype=np.int64)


def _packed(visible: BoolArray) -> bytes:
    """The runs of a set; none behind the last visible object."""
    edges = np.flatnonzero(np.diff(visible.astype(np.int8), prepend=0, append=0))
    return b"".join(map(leb128, np.diff(edges, prepend=0).tolist()))


def leb128(value: int) -> bytes:
    """A number, seven bits a byte, low ones first; the top bit says that more bytes follow."""
    some = bytearray()
    while value > 0x7F:
        some.append(value & 0x7F | 0x80)
        value >>= 7
    some.append(value)
    return bytes(some)


def _lengths(raw: NDArray[np.uint8]) -> NDArray[np.int64]:
    """The numbers of a run of LEB128 bytes."""
    last = raw < 0x80
    if len(raw) and not last[-1]:
        raise ValueError("the last number goes on")
    ends = np.flatnonzero(last)
    starts = np.concatenate([[0], ends[:-1] + 1]).astype(np.int64)[: len(ends)]
    within = np.arange(len(raw)) - np.repeat(starts, ends - starts + 1)
    if len(within) and within.max() > 4:
        raise ValueError("a number has more than 35 bits")
    parts = (raw & 0x7F).astype(np.int64) << (7 * within)
    return np.add.reduceat(parts, starts) if len(ends) else np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Pvs:
    """What is potentially visible from each cell; outside of all cells that is everything.

    What is in no set of the cells that hold a viewer is hidden from it, if ``conservative``, and
    else by all that was looked at.

    ``up``         the scene's up axis: a world point (x, y, z) has its coordinates in turn, so that
                   the last is along this axis, less ``origin`` (3,), in the cells' space.
    ``names``      of the objects, in the scene's order.
    ``order``      (n,) int32: the objects as the rows have them, so that these have few runs.
    ``row_of``     (c,) int64: the row of each cell, or :data:`UNKNOWN`.
    ``method``     that found the sets, of :data:`METHODS`.
    ``scene``      8 bytes that tell this scene from another.
    ``settings``   8 bytes that tell settings from others: sets by the same ones may stand together.
    """

    up: Axis
    origin: FloatArray
    names: tuple[str, ...]
    order: NDArray[np.int32]
    cells: ViewCells
    rows: Rows
    row_of: NDArray[np.int64]
    method: str
    conservative: bool
    scene: bytes
    settings: bytes

    @property
    def computed(self) -> NDArray[np.int64]:
        """The cells that are computed, ascending."""
        return np.flatnonzero(self.row_of != UNKNOWN)

    @property
    def partial(self) -> bool:
        """Whether some cells are not computed."""
        return len(self.computed) < len(self.cells)

    def visible(self, where: int | ArrayLike) -> BoolArray:
        """(n,) whether each object is potentially visible, in the scene's order.

        ``where``  a cell's number, or a world point (3,); where cells overlap a viewer sees no more
                   than the set of any of them.  Raises :class:`OptionError`.
        """
        if isinstance(where, int | np.integer):
            if not 0 <= where < len(self.cells):
                raise OptionError(
                    f"there is no cell {where}", where="cell",
                    remedy=f"give 0 to {len(self.cells) - 1}, or a point",
                )  # fmt: skip
            return self._set_of([int(where)])
        point = self.to_cells(vector("point", where))
        return self._set_of(self.cells.containing(point).tolist())

    def to_cells(self, points: FloatArray) -> FloatArray:
        """World points (…, 3) in the space of the cells."""
        return np.asarray(points[..., axis_order(self.up)] - self.origin)

    def _set_of(self, cells: Sequence[int]) -> BoolArray:
        seen = np.ones(len(self.names), dtype=np.bool_)
        for cell in cells:
            if self.row_of[cell] != UNKNOWN:
                own = np.empty_like(seen)
                own[self.order] = self.rows.row(int(self.row_of[cell]), len(seen))
                seen &= own
        return seen
