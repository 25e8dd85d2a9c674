"""Where the values of a PLY element's rows are.

Rows are equally long in most files (all faces triangles): then the positions are a range and the
values a strided view.  Otherwise the list lengths have to be read one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.float32 import to_float64
from simplifier.io.ply_body import Body, Positions
from simplifier.io.ply_header import Element, Property, quoted
from simplifier.io.polygons import IndexArray
from simplifier.kernels.ply import NEGATIVE, TRUNCATED, walk_rows

_LARGEST = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class Rows:
    """``positions``: of each property in every row (of a list: of its length); ``end``: behind."""

    body: Body
    positions: dict[str, Positions]
    end: int
    where: str

    def scalars(self, one: Property) -> FloatArray:
        """(n,) float64."""
        values = self.body.gather(one.kind, self.positions[one.name], 1)
        return to_float64(values[:, 0])

    def lists(self, one: Property) -> tuple[IndexArray, IndexArray]:
        """Length of each list, and the items of all lists in a row, both int64."""
        body, positions = self.body, self.positions[one.name]
        sizes = body.gather(one.count_kind, positions, 1)[:, 0].astype(np.int64)
        skip = body.size(one.count_kind)
        if isinstance(positions, range):
            inside = range(positions.start + skip, positions.stop + skip, positions.step)
            width = int(sizes[0]) if len(sizes) else 0
            return sizes, self._whole(body.gather(one.kind, inside, width)).ravel()
        ends = np.cumsum(sizes)
        items = np.empty(int(sizes.sum()), dtype=np.int64)
        for size in np.unique(sizes[sizes > 0]).tolist():
            group = np.nonzero(sizes == size)[0]
            places = (ends - sizes)[group, None] + np.arange(size)
            items[places] = self._whole(body.gather(one.kind, positions[group] + skip, size))
        return sizes, items

    def _whole(self, values: NDArray[Any]) -> IndexArray:
        """The values as int64; text may hold other numbers where the header promises whole ones."""
        if values.dtype.kind == "f":
            wrong = ~((np.abs(values) < 2**53) & (values == np.floor(values)))
            if wrong.any():
                raise UnreadableMeshError(
                    f"{values[wrong][0]:g} is not the index of a vertex", where=self.where
                )
        elif values.dtype.kind == "u" and values.size and values.max() > _LARGEST:
            raise UnreadableMeshError(
                f"{values.max()} is not the index of a vertex", where=self.where
            )
        return values.astype(np.int64)


def locate_rows(body: Body, element: Element, start: int, where: str) -> Rows:
    """Raises :class:`UnreadableMeshError` when the data end inside the element."""
    least = sum(body.size(one.count_kind or one.kind) for one in element.properties)
    # Also what keeps a damaged count from asking for more memory than the file is long.
    if element.count * least > body.length - start:
        raise _truncated(element, where)
    if element.count == 0 or least == 0:
        return Rows(body, {one.name: range(0) for one in element.properties}, start, where)
    return _equal_rows(body, element, start, where) or _walk_rows(body, element, start, where)


def _equal_rows(body: Body, element: Element, start: int, where: str) -> Rows | None:
    """The rows, if all of them have the list lengths of the first one."""
    offsets: dict[str, int] = {}
    lengths: dict[str, int] = {}
    width = 0
    for one in element.properties:
        offsets[one.name] = width
        if not one.count_kind:
            width += body.size(one.kind)
            continue
        if start + width + body.size(one.count_kind) > body.length:
            return None
        lengths[one.name] = body.integer(one.count_kind, start + width)
        if lengths[one.name] < 0:
            return None
        width += body.size(one.count_kind) + lengths[one.name] * body.size(one.kind)
    end = start + element.count * width
    if end > body.length:
        return None
    positions = {
        name: range(start + offset, end + offset, width) for name, offset in offsets.items()
    }
    for one in element.properties:
        if one.count_kind:
            counts = body.gather(one.count_kind, positions[one.name], 1)
            if (counts != lengths[one.name]).any():
                return None
    return Rows(body, dict(positions), end, where)


def _walk_rows(body: Body, element: Element, start: int, where: str) -> Rows:
    """Read the list lengths row by row."""
    kinds = [(one.count_kind or one.kind, one.count_kind, one.kind) for one in element.properties]
    counted = np.array([bool(count) for _, count, _ in kinds])
    sizes = np.array([body.size(first) for first, _, _ in kinds], dtype=np.int64)
    items = np.array([body.size(kind) for _, _, kind in kinds], dtype=np.int64)
    signed = np.array([first[0] == "i" for first, _, _ in kinds])
    places = np.empty((element.count, len(kinds)), dtype=np.int64)
    cells = body.whole_cells()
    end, row = walk_rows(cells, start, counted, sizes, items, signed, body.big_endian, places)
    if end == TRUNCATED:
        raise _truncated(element, where)
    if end == NEGATIVE:
        raise UnreadableMeshError(
            f"{quoted(element.name)} {row} has a list without a proper length", where=where
        )
    names = [one.name for one in element.properties]
    return Rows(body, {name: places[:, k] for k, name in enumerate(names)}, end, where)


def _truncated(element: Element, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(
        f"the file is truncated: its header promises {element.count} of {quoted(element.name)}",
        where=where,
        remedy="copy or export it again",
    )
