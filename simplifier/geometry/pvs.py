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
from simplifier.wording import count

UNKNOWN = -1
"""In place of a row: the cell is not computed, and everything counts as visible from it."""

METHODS = ("cull-map", "slice-wise", "voxel-column", "strong-occluders")
"""What can find the sets; files hold a method's place in this."""

SLICES = 8
"""Slices of an object's box along each axis, all as thick as each other."""

NEVER = 0xFFFF
"""In place of an altitude: nothing of the object is seen, however high the viewer is."""

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

    def places(self, index: int) -> NDArray[np.int64]:
        """(k,) where the visible objects of a set stand in it, in a time that they alone take."""
        raw = np.frombuffer(self.data, np.uint8)[self.offsets[index] : self.offsets[index + 1]]
        lengths = _lengths(raw)
        visible = lengths[1::2]
        hidden = np.cumsum(lengths[: 2 * len(visible) : 2])
        return np.arange(visible.sum()) + np.repeat(hidden, visible)

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


def drawn(values: NDArray[np.int8], count: int = SLICES) -> NDArray[np.int64]:
    """(k, 3, 2) the lowest and the highest slice of each axis that is drawn, counted from 1.

    The slices of *all* axes are drawn, each triangle once: a point of the object is hidden only if
    no axis draws a slice that it is in (Yilmaz and Gudukbay, *Conservative Occlusion Culling for
    Urban Visualization Using a Slice-Wise Data Structure*, 2007, algorithm 3 and figure 19).  An
    axis that draws none has 1 and 0.  Where all is drawn each axis has 1 and ``count``.

    ``values``  (k, 3) as in :class:`Slices`.
    """
    value = values.astype(np.int64)
    ranges = np.stack([np.ones_like(value), np.zeros_like(value)], axis=-1)
    plan, height = value[:, :2], value[:, 2]
    ranges[:, :2, 0] = np.where(plan < 0, 1 - plan, 1)
    ranges[:, :2, 1] = np.where(plan < 0, count, plan)
    ranges[:, 2, 0] = np.maximum(height, 1)
    ranges[:, 2, 1] = np.where(height > 0, count, 0)
    ranges[(value == 0).all(axis=1)] = (1, count)
    return ranges


@dataclass(frozen=True, eq=False)
class Slices:
    """Which parts of visible objects are drawn: by slices across the axes of the cells' space.

    An object's box is cut into ``count`` slices along each axis, numbered from 1 at the low side.
    A part of the object is hidden if each axis whose number is not 0 hides it.  An axis with 0 is
    left out, and an object with 0 0 0 is drawn as a whole.

    ``starts``  (c + 1,) int64: where the visible objects of each cell begin in ``values``, and the
                end; a cell that is not computed has none.  They are in the scene's order.
    ``values``  (pairs, 3) int8.  Along the two axes of the plan +k is the last slice that is drawn,
                those above it are hidden; -k is the last one that is hidden, those above it are
                drawn.  Along the up axis k is the first slice that is drawn, those below it are
                hidden.  Every axis draws a slice: -count < x, y <= count and 0 <= z <= count.
    """

    starts: NDArray[np.int64]
    values: NDArray[np.int8]
    count: int = SLICES

    def of(self, cell: int) -> NDArray[np.int8]:
        """(k, 3) of the objects that are visible from a cell, in the scene's order."""
        return self.values[self.starts[cell] : self.starts[cell + 1]]


@dataclass(frozen=True, eq=False)
class Altitudes:
    """From which altitude on anything of an object is seen.

    ``low``, ``step``  altitude k is low + k step, a height in the cells' space; both are float32
                       numbers, and ``step`` is positive.
    ``values``  (c, n) uint16, objects in the scene's order: below this altitude nothing of the
                object is seen from anywhere in the cell's plan.  0 is seen from any height, and
                :data:`NEVER` from none.  A cell that is not computed has 0.
    """

    low: float
    step: float
    values: NDArray[np.uint16]

    def seen(self, cell: int, height: float) -> BoolArray:
        """(n,) what may be seen from a height over the plan of a cell, in the cells' space."""
        altitudes = self.values[cell]
        # Exact but for the sum, so readers that fuse both round alike.
        above = self.low + self.step * altitudes.astype(np.float64) > height
        return np.asarray(((altitudes == 0) | ~above) & (altitudes != NEVER))

    def counted(self, low: float, step: float) -> Altitudes:
        """The same by other numbers: none of the altitudes is higher than before."""
        if (low, step) == (self.low, self.step):
            return self
        heights = self.low + self.step * self.values.astype(np.float64)
        steps = np.clip(np.floor((heights - low) / step), 0, NEVER - 1)
        steps -= (low + step * steps > heights) & (steps > 0)  # where the quotient was rounded up
        steps[self.values == 0], steps[self.values == NEVER] = 0, NEVER
        return Altitudes(low, step, steps.astype(np.uint16))


def float32_below(value: float) -> float:
    """The largest float32 number that is no larger."""
    near = np.float32(value)
    return float(near if float(near) <= value else np.nextafter(near, np.float32(-np.inf)))


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
    ``slices``     which parts of the objects are drawn; None if each is drawn as a whole.
    ``altitudes``  from which height on each object is seen; None if that is not known.
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
    slices: Slices | None = None
    altitudes: Altitudes | None = None

    def __repr__(self) -> str:
        cells, objects = count(len(self.cells), "cell"), count(len(self.names), "object")
        return f"<Pvs: {cells}, {objects}, by {self.method}>"

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
                   than the set of any of them.  With altitudes a point sees only what is seen from
                   its height, a cell what is seen from any of its heights.
                   Raises :class:`OptionError`.
        """
        if isinstance(where, int | np.integer):
            return self._set_of([self._checked(where)])
        point = self.to_cells(vector("point", where))
        return self._set_of(self.cells.containing(point).tolist(), float(point[2]))

    def drawn(self, cell: int) -> NDArray[np.int64]:
        """(n, 3, 2) the slices of each object that are drawn for a cell, as :func:`drawn` has them.

        Objects that are not visible have 1 and 0 along each axis.  Without slices an object is one.
        Raises :class:`OptionError`.
        """
        cell = self._checked(cell)
        visible, cut = self._set_of([cell]), self.slices
        count = 1 if cut is None else cut.count
        ranges = np.tile(np.array([1, 0]), (len(visible), 3, 1))
        if cut is None or self.row_of[cell] == UNKNOWN:
            ranges[visible] = (1, count)
        else:
            ranges[visible] = drawn(cut.of(cell), count)
        return ranges

    def to_cells(self, points: FloatArray) -> FloatArray:
        """World points (…, 3) in the space of the cells."""
        return np.asarray(points[..., axis_order(self.up)] - self.origin)

    def _checked(self, cell: int | np.integer) -> int:
        if not 0 <= cell < len(self.cells):
            raise OptionError(
                f"there is no cell {cell}", where="cell",
                remedy=f"give 0 to {len(self.cells) - 1}, or a point",
            )  # fmt: skip
        return int(cell)

    def _set_of(self, cells: Sequence[int], height: float | None = None) -> BoolArray:
        seen = np.ones(len(self.names), dtype=np.bool_)
        for cell in cells:
            if self.row_of[cell] != UNKNOWN:
                own = np.empty_like(seen)
                own[self.order] = self.rows.row(int(self.row_of[cell]), len(seen))
                seen &= own
                if height is not None and self.altitudes is not None:
                    seen &= self.altitudes.seen(cell, height)
        return seen
