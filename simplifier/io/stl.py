"""STL, binary and ASCII: unconnected triangles in float32."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.claim import Claim, Peek, estimate_matches
from simplifier.io.float32 import to_float32, to_float64, unit_normals
from simplifier.io.text import count_statements, read_statements, without_mark

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET_LINE = re.compile(rb"(?im)^[ \t]*facet\b(.*)$")
_END = re.compile(rb"[\r\n][ \t]*end[ \t]*solid\b", re.IGNORECASE)


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for a binary file of another size than it states."""
    if _is_binary(start, size):
        _check_size(start, size, where)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Three vertices a triangle, float64 of the file's float32, and faces 0 1 2, 3 4 5, ….

    Binary is told from text by its size, 84 + 50 n bytes: many binary files begin with "solid" as
    text files must.  Raises :class:`UnreadableMeshError`.
    """
    where = str(path)
    if _is_binary(data, len(data)):
        vertices = _decode_binary(data, where)
    else:
        vertices = _decode_text(without_mark(data), where)
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)


def claim(peek: Peek) -> Claim:
    """Of a text the facets are estimated."""
    head = peek.read(0, 512)
    if _is_binary(head, peek.size):
        count = min(_facet_count(head), max(peek.size - _HEADER_BYTES, 0) // 50)
        # The file, its corners as float32, and those as float64.
        return Claim(3 * count, count, peek.size + (36 + 72) * count)
    count, _ = estimate_matches(peek, _FACET_LINE)
    # The file, the corners, and as many places of words that Python has to read.
    return Claim(3 * count, count, peek.size + (72 + 72) * count)


def _facet_count(data: bytes) -> int:
    return int.from_bytes(data[80:84], "little")


def _is_binary(data: bytes, size: int) -> bool:
    """By the first 512 bytes or more of a file of that size."""
    if size >= _HEADER_BYTES and size == _HEADER_BYTES + 50 * _facet_count(data):
        return True
    text = without_mark(data).lstrip()[:5].lower() == b"solid"
    return not text or b"\0" in data[:512]


def _check_size(start: bytes, size: int, where: str) -> None:
    count = _facet_count(start)
    if count == 0 and size > _HEADER_BYTES:
        raise UnreadableMeshError(
            f"neither a text STL nor a binary one: {size} bytes, and the header promises no"
            " triangle",
            where=where,
            remedy="export it again; the program that wrote it may have been cut short",
        )
    # Bytes behind the last facet are common and harmless.
    if size < _HEADER_BYTES or size < _HEADER_BYTES + 50 * count:
        raise UnreadableMeshError(
            f"neither a text STL nor a whole binary one: {size} bytes, and the header would"
            f" promise {count} triangles, {_HEADER_BYTES + 50 * count} bytes",
            where=where,
            remedy="the file may be truncated; copy or export it again",
        )


def _decode_binary(data: bytes, where: str) -> FloatArray:
    _check_size(data, len(data), where)
    facets = np.frombuffer(data, dtype=_FACET, count=_facet_count(data), offset=_HEADER_BYTES)
    return to_float64(facets["corners"].reshape(-1, 3))


def _decode_text(data: bytes, where: str) -> FloatArray:
    if _END.search(data, max(len(data) - 4096, 0)) is None:
        raise UnreadableMeshError(
            "the file is truncated: no 'endsolid'",
            where=where,
            remedy="copy or export it again",
        )
    vertices = read_statements(data, b"vertex", 3, where)
    facets = count_statements(data, b"facet")
    if len(vertices) != 3 * facets:
        raise UnreadableMeshError(
            f"{facets} facets have {len(vertices)} vertices instead of {3 * facets}",
            where=where,
            remedy="the file is damaged; export triangles, one statement a line",
        )
    return vertices


def encode(occluder: Occluder) -> bytes:
    """Binary STL.  float32 in absolute coordinates: a coordinate c keeps about |c| * 6e-8."""
    corners = occluder.vertices[occluder.faces]
    facets = np.zeros(len(corners), dtype=_FACET)
    facets["corners"] = to_float32(corners)
    facets["normal"] = unit_normals(corners)
    header = b"planar-occluder".ljust(80, b"\0")
    return header + len(corners).to_bytes(4, "little") + facets.tobytes()
