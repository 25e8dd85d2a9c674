"""Object File Format: ``OFF`` and its variants with colours, normals or texture coordinates."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.claim import Claim, Peek
from simplifier.io.polygons import triangulate_polygons
from simplifier.io.text import NumberLines, read_numbers, without_mark

# Geomview's grammar is [ST][C][N][4][n]OFF [BINARY]; the letters only add numbers behind x y z.
# Many files of ModelNet have no blank between OFF and the counts.
_BEFORE = re.compile(rb"(?:[ \t]*(?:#[^\r\n]*)?[\r\n])*[ \t]*")
_HEADER = re.compile(_BEFORE.pattern + rb"(ST)?(C)?(N)?(4)?(n)?(?:OFF|off)(?:\b|(?=\d))")
_BINARY = re.compile(rb"[ \t]+BINARY\b")

_HEAD = 1 << 16  # bytes


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` unless OFF stands first, or may come after comments."""
    text = without_mark(start)
    before = _BEFORE.match(text)
    rest = text[before.end() :] if before else text
    if size <= len(start) or (rest and not rest.startswith(b"#")):
        _header_end(text, where)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 in file order and triangulated faces (m, 3) int64.

    One vertex and one face a line; the counts may stand behind the keyword or on a line of their
    own.  Raises :class:`UnreadableMeshError`.
    """
    where = str(path)
    data = without_mark(data)
    lines = read_numbers(data, where, begin=_header_end(data, where))
    if len(lines.firsts) < 2 or lines.firsts[1] < 2:
        raise UnreadableMeshError("the counts of vertices and faces are missing", where=where)
    vertex_count, face_count = (_count(value, where) for value in lines.values[:2])
    if len(lines.firsts) - 2 < vertex_count + face_count:
        raise UnreadableMeshError(
            f"the file is truncated: {vertex_count} vertices and {face_count} faces were promised,"
            f" {len(lines.firsts) - 2} lines follow",
            where=where,
            remedy="copy or export it again, one vertex or face a line",
        )
    vertices = _read_vertices(lines, vertex_count, where)
    sizes, corners = _read_faces(lines, 1 + vertex_count, face_count, where)
    return vertices, triangulate_polygons(vertices, sizes, corners, where=where)


def claim(peek: Peek) -> Claim:
    """The counts of the header; faces count as triangles."""
    where = str(peek.path)
    # Whole lines; comments before the counts are hardly ever longer.
    head = without_mark(peek.read(0, _HEAD)).rpartition(b"\n")[0]
    lines = read_numbers(head, where, begin=_header_end(head, where))
    counts = [min(_count(value, where), peek.size) for value in lines.values[:2]]
    vertices, faces = counts if len(counts) == 2 else (0, 0)
    # The file; all words as numbers and where those are that Python has to read; then vertices,
    # and of the faces twice where their corners are.
    words = 3 * vertices + 4 * faces
    return Claim(vertices, faces, peek.size + 16 * words + 24 * vertices + (48 + 24) * faces)


def _header_end(data: bytes, where: str) -> int:
    header = _HEADER.match(data)
    if header is None:
        raise UnreadableMeshError("the file does not begin with OFF", where=where)
    if header[4] or header[5]:
        raise UnreadableMeshError(
            "vertices with other than three coordinates (4OFF, nOFF) are not supported",
            where=where,
            remedy="export three-dimensional vertices",
        )
    if _BINARY.match(data, header.end()):
        raise UnreadableMeshError(
            "binary OFF is not supported", where=where, remedy="export it as text, or as PLY"
        )
    return header.end()


def _count(value: float, where: str) -> int:
    if not 0.0 <= value < 2**31 or value != int(value):
        raise UnreadableMeshError(f"{value:g} is not a count of vertices or faces", where=where)
    return int(value)


def _read_vertices(lines: NumberLines, count: int, where: str) -> FloatArray:
    starts, widths = lines.firsts[1 : 1 + count], np.diff(lines.firsts)[1 : 1 + count]
    short = np.nonzero(widths < 3)[0]
    if len(short):
        raise UnreadableMeshError(
            f"vertex {int(short[0])} has fewer than three coordinates", where=where
        )
    return np.asarray(lines.values[starts[:, None] + np.arange(3)])


def _read_faces(
    lines: NumberLines, line: int, count: int, where: str
) -> tuple[IndexArray, IndexArray]:
    """Corner count of each face and all corners; colours behind the corners are left out."""
    starts = lines.firsts[line : line + count]
    widths = np.diff(lines.firsts)[line : line + count]
    claimed = lines.values[starts]
    # The comparison is false for NaN too; ``widths`` bounds what is allocated below.
    wrong = np.nonzero(~((claimed >= 0.0) & (claimed < widths) & (claimed == np.floor(claimed))))[0]
    if len(wrong):
        raise UnreadableMeshError(
            f"face {int(wrong[0])} promises {claimed[wrong[0]]:g} corners,"
            f" but {int(widths[wrong[0]]) - 1} numbers follow",
            where=where,
        )
    sizes = claimed.astype(np.int64)
    ends = np.cumsum(sizes)
    places = np.arange(int(sizes.sum())) + np.repeat(starts + 1 - (ends - sizes), sizes)
    corners = lines.values[places]
    whole = (np.abs(corners) < 2**53) & (corners == np.floor(corners))
    if not whole.all():
        raise UnreadableMeshError(f"{corners[~whole][0]:g} is not a vertex index", where=where)
    return sizes, corners.astype(np.int64)


def encode(occluder: Occluder, *polygons: IntArray) -> bytes:
    """Text with the shortest digits that give back the same float64.

    ``polygons``  (k, n) faces of n corners, in place of the occluder's own.
    """
    kinds = polygons or (occluder.faces,)
    lines = ["OFF", f"{len(occluder.vertices)} {sum(map(len, kinds))} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in occluder.vertices.tolist()]
    for faces in kinds:
        lines += [f"{len(face)} {' '.join(map(str, face))}" for face in faces.tolist()]
    return "\n".join([*lines, ""]).encode("ascii")
