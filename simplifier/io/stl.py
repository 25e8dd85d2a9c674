"""STL, binary and ASCII: unconnected triangles in float32."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.float32 import to_float32, to_float64, unit_normals
from simplifier.io.polygons import IndexArray
from simplifier.io.text import count_statements, read_statements, without_mark

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_END = re.compile(rb"[\r\n][ \t]*end[ \t]*solid\b", re.IGNORECASE)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Three vertices a triangle, float64 of the file's float32, and faces 0 1 2, 3 4 5, ….

    Binary is told from text by its size, 84 + 50 n bytes: many binary files begin with "solid" as
    text files must.  Raises :class:`UnreadableMeshError`.
    """
    where = str(path)
    if _is_binary(data):
        vertices = _decode_binary(data, where)
    else:
        vertices = _decode_text(without_mark(data), where)
    return vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)


def _facet_count(data: bytes) -> int:
    return int.from_bytes(data[80:84], "little")


def _is_binary(data: bytes) -> bool:
    if len(data) >= _HEADER_BYTES and len(data) == _HEADER_BYTES + 50 * _facet_count(data):
        return True
    text = without_mark(data).lstrip()[:5].lower() == b"solid"
    return not text or b"\0" in data[:512]


def _decode_binary(data: bytes, where: str) -> FloatArray:
    count = _facet_count(data)
    # Bytes behind the last facet are common and harmless.
    if len(data) < _HEADER_BYTES or len(data) < _HEADER_BYTES + 50 * count:
        raise UnreadableMeshError(
            f"neither a text STL nor a whole binary one: {len(data)} bytes, and the header would"
            f" promise {count} triangles, {_HEADER_BYTES + 50 * count} bytes",
            where=where,
            remedy="the file may be truncated; copy or export it again",
        )
    facets = np.frombuffer(data, dtype=_FACET, count=count, offset=_HEADER_BYTES)
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
