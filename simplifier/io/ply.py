"""Stanford PLY: text, and binary in both byte orders; written as little-endian binary doubles.

Where the values of a PLY element's rows are.

Rows are equally long in most files (all faces triangles): then the positions are a range and the
values a strided view.  Otherwise the list lengths have to be read one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.claim import Claim, Peek
from simplifier.io.float32 import to_float64
from simplifier.io.ply_header import (
    LONGEST_HEADER,
    BinaryBody,
    Body,
    Element,
    PlyHeader,
    Positions,
    Property,
    TextBody,
    check_magic,
    quote_name,
    read_header,
)
from simplifier.io.polygons import split_strips, triangulate_polygons
from simplifier.io.text import read_numbers, without_mark


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` unless it begins as a PLY file does."""
    check_magic(without_mark(start), where)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 in file order; triangulated faces (m, 3) int64, then strips.

    Reads x, y, z of ``vertex``, ``vertex_indices`` or ``vertex_index`` of ``face`` and of
    ``tristrips``; skips everything else.  Raises :class:`UnreadableMeshError`.
    """
    where = str(path)
    data = without_mark(data)
    header = read_header(data, where)
    elements = _locate(data, header, where)
    vertices = _read_vertices(*_element_or_refuse(elements, "vertex", where), where)
    faces = []
    if "face" in elements:
        sizes, corners = _read_lists(*elements["face"], where)
        faces.append(triangulate_polygons(vertices, sizes, corners, where=where))
    if "tristrips" in elements:
        strips = split_strips(*_read_lists(*elements["tristrips"], where))
        sizes = np.full(len(strips), 3, dtype=np.int64)
        faces.append(triangulate_polygons(vertices, sizes, strips.ravel(), where=where))
    if len(faces) == 1:
        return vertices, faces[0]
    return vertices, np.concatenate([np.empty((0, 3), dtype=np.int64), *faces])


def claim(peek: Peek) -> Claim:
    """Faces of more than three corners are counted by the bytes that the header leaves for them."""
    header = read_header(without_mark(peek.read(0, LONGEST_HEADER + 64)), str(peek.path))
    counts = {element.name: min(element.count, peek.size) for element in header.elements}
    vertices, faces = counts.get("vertex", 0), counts.get("face", 0)
    corners = _count_claimed_corners(header, faces, peek.size - header.end)
    triangles = max(corners - 2 * faces, 0)
    # The file; vertices; of each face its size, twice where it begins, and where its corners are.
    decoding = peek.size + 24 * vertices + (8 + 16) * faces + (8 + 3) * corners
    if corners != 3 * faces:  # the lists lie apart, and each size is triangulated by itself
        decoding += 16 * corners + 24 * triangles
    if not header.byte_order:  # all words as numbers, and where those are that Python has to read
        decoding += 16 * (3 * vertices + corners + faces)
    return Claim(vertices, triangles, decoding)


def _count_claimed_corners(header: PlyHeader, faces: int, body: int) -> int:
    """Of all faces: what the rows of fixed length leave; three a face in text."""
    if not header.byte_order or not faces:
        return 3 * faces
    fixed, item = 0, 0
    for element in header.elements:
        for one in element.properties:
            fixed += element.count * int((one.count_kind or one.kind)[1])
            if one.count_kind:
                item = item or int(one.kind[1])
    return max(body - fixed, 0) // (item or 4)


def _locate(data: bytes, header: PlyHeader, where: str) -> dict[str, tuple[Element, ElementRows]]:
    """Every element up to the last one that is needed, by name."""
    needed = {"vertex", "face", "tristrips"}
    body: Body
    if header.byte_order:
        body, position = BinaryBody(data, header.byte_order), header.end
    else:
        body, position = TextBody(read_numbers(data, where, begin=header.end).values), 0
    found: dict[str, tuple[Element, ElementRows]] = {}
    for index, element in enumerate(header.elements):
        if not needed & {later.name for later in header.elements[index:]}:
            break
        rows = locate_rows(body, element, position, where)
        position = rows.end
        found.setdefault(element.name, (element, rows))
    return found


def _element_or_refuse(
    elements: dict[str, tuple[Element, ElementRows]], name: str, where: str
) -> tuple[Element, ElementRows]:
    if name not in elements:
        raise UnreadableMeshError(f"the PLY file has no element '{name}'", where=where)
    return elements[name]


def _read_vertices(element: Element, rows: ElementRows, where: str) -> FloatArray:
    axes = [_coordinate(element, name, where) for name in "xyz"]
    # Only now: with a coordinate in each row, the count is no more than the file can hold.
    vertices = np.empty((element.count, 3))
    for axis, one in enumerate(axes):
        vertices[:, axis] = rows.scalars(one)
    return vertices


def _coordinate(element: Element, name: str, where: str) -> Property:
    one = element.property(name)
    if one is None or one.count_kind:
        raise UnreadableMeshError(f"the vertices have no coordinate '{name}'", where=where)
    return one


def _read_lists(element: Element, rows: ElementRows, where: str) -> tuple[IndexArray, IndexArray]:
    one = element.property("vertex_indices", "vertex_index")
    if one is None or not one.count_kind or one.kind[0] == "f":
        raise UnreadableMeshError(
            f"'{element.name}' has no list of whole numbers 'vertex_indices'", where=where
        )
    return rows.lists(one)


def encode(occluder: Occluder, *polygons: IntArray) -> bytes:
    """Binary little-endian, vertices as doubles.

    ``polygons``  (k, n) faces of n corners, in place of the occluder's own.
    """
    vertices, kinds = occluder.vertices, polygons or (occluder.faces,)
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment planar-occluder\n"
        f"element vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {sum(map(len, kinds))}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = b"".join(_rows(faces) for faces in kinds)
    return header.encode("ascii") + vertices.astype("<f8").tobytes() + rows


def _rows(faces: IntArray) -> bytes:
    corners = faces.shape[1]
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", corners)])
    rows["count"] = corners
    rows["corners"] = faces
    return rows.tobytes()


_LARGEST = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class ElementRows:
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


def locate_rows(body: Body, element: Element, start: int, where: str) -> ElementRows:
    """Raises :class:`UnreadableMeshError` when the data end inside the element."""
    least = sum(body.size(one.count_kind or one.kind) for one in element.properties)
    # Also what keeps a damaged count from asking for more memory than the file is long.
    if element.count * least > body.length - start:
        raise _truncation(element, where)
    if element.count == 0 or least == 0:
        return ElementRows(body, {one.name: range(0) for one in element.properties}, start, where)
    return _equal_rows(body, element, start, where) or _walk_rows(body, element, start, where)


def _equal_rows(body: Body, element: Element, start: int, where: str) -> ElementRows | None:
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
    return ElementRows(body, dict(positions), end, where)


def _walk_rows(body: Body, element: Element, start: int, where: str) -> ElementRows:
    """Read the list lengths row by row."""
    from simplifier.kernels import ply as kernels  # in most files rows are equally long

    kinds = [(one.count_kind or one.kind, one.count_kind, one.kind) for one in element.properties]
    counted = np.array([bool(count) for _, count, _ in kinds])
    sizes = np.array([body.size(first) for first, _, _ in kinds], dtype=np.int64)
    items = np.array([body.size(kind) for _, _, kind in kinds], dtype=np.int64)
    signed = np.array([first[0] == "i" for first, _, _ in kinds])
    places = np.empty((element.count, len(kinds)), dtype=np.int64)
    cells = body.whole_cells()
    walk: Any = kernels.walk_rows if cells.dtype == np.uint8 else kernels.walk_text_rows
    end, row = walk(cells, start, counted, sizes, items, signed, body.big_endian, places)
    if end == kernels.TRUNCATED:
        raise _truncation(element, where)
    if end == kernels.NEGATIVE:
        raise UnreadableMeshError(
            f"{quote_name(element.name)} {row} has a list without a proper length", where=where
        )
    names = [one.name for one in element.properties]
    return ElementRows(body, {name: places[:, k] for k, name in enumerate(names)}, end, where)


def _truncation(element: Element, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(
        f"the file is truncated: its header promises {element.count} of {quote_name(element.name)}",
        where=where,
        remedy="copy or export it again",
    )
