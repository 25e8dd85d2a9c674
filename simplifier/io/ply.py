"""Stanford PLY: text, and binary in both byte orders; written as little-endian binary doubles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.claim import Claim, Peek
from simplifier.io.ply_body import BinaryBody, Body, TextBody
from simplifier.io.ply_header import (
    LONGEST_HEADER,
    Element,
    PlyHeader,
    Property,
    check_magic,
    read_header,
)
from simplifier.io.ply_rows import Rows, locate_rows
from simplifier.io.polygons import IndexArray, triangulate_polygons
from simplifier.io.strips import split_strips
from simplifier.io.text import read_numbers, without_mark

_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


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
    vertices = _read_vertices(*_wanted(elements, "vertex", where), where)
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
    corners = _claimed_corners(header, faces, peek.size - header.end)
    triangles = max(corners - 2 * faces, 0)
    # The file; vertices; of each face its size, twice where it begins, and where its corners are.
    decoding = peek.size + 24 * vertices + (8 + 16) * faces + (8 + 3) * corners
    if corners != 3 * faces:  # the lists lie apart, and each size is triangulated by itself
        decoding += 16 * corners + 24 * triangles
    if not header.byte_order:  # all words as numbers, and where those are that Python has to read
        decoding += 16 * (3 * vertices + corners + faces)
    return Claim(vertices, triangles, decoding)


def _claimed_corners(header: PlyHeader, faces: int, body: int) -> int:
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


def _locate(data: bytes, header: PlyHeader, where: str) -> dict[str, tuple[Element, Rows]]:
    """Every element up to the last one that is needed, by name."""
    needed = {"vertex", "face", "tristrips"}
    body: Body
    if header.byte_order:
        body, position = BinaryBody(data, header.byte_order), header.end
    else:
        body, position = TextBody(read_numbers(data, where, begin=header.end).values), 0
    found: dict[str, tuple[Element, Rows]] = {}
    for index, element in enumerate(header.elements):
        if not needed & {later.name for later in header.elements[index:]}:
            break
        rows = locate_rows(body, element, position, where)
        position = rows.end
        found.setdefault(element.name, (element, rows))
    return found


def _wanted(
    elements: dict[str, tuple[Element, Rows]], name: str, where: str
) -> tuple[Element, Rows]:
    if name not in elements:
        raise UnreadableMeshError(f"the PLY file has no element '{name}'", where=where)
    return elements[name]


def _read_vertices(element: Element, rows: Rows, where: str) -> FloatArray:
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


def _read_lists(element: Element, rows: Rows, where: str) -> tuple[IndexArray, IndexArray]:
    one = element.property("vertex_indices", "vertex_index")
    if one is None or not one.count_kind or one.kind[0] == "f":
        raise UnreadableMeshError(
            f"'{element.name}' has no list of whole numbers 'vertex_indices'", where=where
        )
    return rows.lists(one)


def encode(occluder: Occluder) -> bytes:
    """Binary little-endian, vertices as doubles."""
    vertices, faces = occluder.vertices, occluder.faces
    rows = np.empty(len(faces), dtype=_FACE)
    rows["count"] = 3
    rows["corners"] = faces
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment planar-occluder\n"
        f"element vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return header.encode("ascii") + vertices.astype("<f8").tobytes() + rows.tobytes()
