"""The plain binary format for software rasterisers, ``.occ``: one file to map and draw from.

Little-endian; every block begins at a multiple of 16 bytes, so that a program that maps the file
uses it in place.  ``docs/formats.md`` has it byte by byte, and ``integrations/c/occluder.h`` reads
it.  Positions are float32 around an origin in float64, so a city in map coordinates keeps its
millimetres; indices are 16-bit where that is enough.  Triangles that meet share their vertices, as
a flag says; files from before it has a meaning do not, and are read as any others.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import EmptyMeshError, OptionError, UnreadableMeshError
from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import FloatArray, IndexArray, TriangleMesh
from simplifier.geometry.occluder import Level, LodChain, Occluder
from simplifier.geometry.weld import weld
from simplifier.io.claim import Claim, Peek
from simplifier.io.float32 import box_centre, to_float32

MAGIC = b"\x89OCC\r\n\x1a\n"  # as PNG's: a transfer as text damages it
OCC_VERSION = 1
SINGLE_SIDED, WELDED = 1, 2  # of the flags: back faces may be culled; no two vertices are equal
MOST_LEVELS = 64
MOST_SHORT = 65_535  # vertices that 16-bit indices name; the last index means "restart" to some

_ALIGNED = 16
_HEADER = np.dtype([
    ("magic", "S8"), ("version", "<u4"), ("flags", "<u4"), ("file_bytes", "<u8"),
    ("level_count", "<u4"), ("header_bytes", "<u4"), ("origin", "<f8", 3), ("low", "<f4", 3),
    ("high", "<f4", 3), ("pixel_error", "<f8"), ("fov", "<f8"), ("screen_height", "<u4"),
    ("reserved", "<u4", 7),
])  # fmt: skip
_LEVEL = np.dtype([
    ("error_bound", "<f8"), ("deviation", "<f8"), ("switch_distance", "<f8"),
    ("positions", "<u8"), ("indices", "<u8"), ("vertex_count", "<u4"), ("triangle_count", "<u4"),
    ("index_bytes", "<u4"), ("resolution", "<u4"), ("reserved", "<u4", 2),
])  # fmt: skip


def encode(occluder: Occluder) -> bytes:
    """A file of one level, made for no screen in particular.

    Raises :class:`OutputError` when the occluder does not fit float32.
    """
    rows = np.zeros(1, dtype=_LEVEL)
    rows["error_bound"] = occluder.error_bound
    rows["deviation"] = math.nan
    return _pack(np.zeros((), dtype=_HEADER), rows, [occluder])


def encode_lods(chain: LodChain) -> bytes:
    """A file of all levels, finest first, with the distances to change them at.

    Raises :class:`OutputError` when an occluder does not fit float32.
    """
    header = np.zeros((), dtype=_HEADER)
    header["pixel_error"], header["fov"] = chain.pixel_error, chain.lens.fov
    header["screen_height"] = chain.lens.rows
    rows = np.zeros(len(chain.levels), dtype=_LEVEL)
    for index, level in enumerate(chain.levels):
        rows[index]["error_bound"] = level.error_bound
        rows[index]["deviation"] = level.deviation
        rows[index]["switch_distance"] = chain.switch_distance(index)
        rows[index]["resolution"] = level.resolution
    return _pack(header, rows, [level.occluder for level in chain.levels])


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """The finest level: vertices (n, 3) float64 in world coordinates, faces (m, 3) int64.

    Raises :class:`UnreadableMeshError`.
    """
    header, rows = _open(data, str(path))
    return _level_arrays(data, header, rows[0], 0, str(path))


def claim(peek: Peek) -> Claim:
    """Of the finest level: its counts, held to what the file has room for."""
    start = peek.read(0, _HEADER.itemsize + _LEVEL.itemsize)
    if len(start) < _HEADER.itemsize + _LEVEL.itemsize:
        return Claim(0, 0, 0)
    row = np.frombuffer(start, dtype=_LEVEL, count=1, offset=_HEADER.itemsize)[0]
    vertices = min(int(row["vertex_count"]), peek.size // 12)
    triangles = min(int(row["triangle_count"]), peek.size // 6)
    return Claim(vertices, triangles, peek.size + 24 * (vertices + triangles))


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what does not begin as an occluder file."""
    if size < _HEADER.itemsize or not start.startswith(MAGIC):
        raise _damage("this is no occluder file: it does not begin as one", where)


def error_bound(data: bytes, path: Path) -> float:
    """Of the finest level, infinite when none was promised."""
    return float(_open(data, str(path))[1][0]["error_bound"])


def decode_lods(data: bytes, path: Path) -> LodChain:
    """All levels and the lens that they were made for.

    Raises :class:`UnreadableMeshError`, also for an occluder that was written by itself.
    """
    where = str(path)
    header, rows = _open(data, where)
    if header["screen_height"] == 0:
        raise UnreadableMeshError(
            "holds no levels of detail",
            where=where,
            remedy="name a file that was written with them",
        )
    lens, pixels = _screen(header, where)
    levels: list[Level] = []
    for index, row in enumerate(rows):
        arrays = _level_arrays(data, header, row, index, where)
        bound, deviation = float(row["error_bound"]), float(row["deviation"])
        if not 0.0 <= deviation < math.inf:
            raise _damage(f"the deviation of level {index} is {deviation}", where)
        if levels and bound < levels[-1].error_bound:
            raise _damage("the error bounds of its levels fall", where)
        levels.append(Level(_occluder(*arrays, bound, where), int(row["resolution"]), deviation))
    return LodChain(tuple(levels), lens, pixels)


def _screen(header: np.void, where: str) -> tuple[Lens, float]:
    """The lens, and the error in pixels, that the levels are for."""
    pixels = float(header["pixel_error"])
    if not 0.0 < pixels < math.inf:
        raise _damage(f"its levels are for an error of {pixels} pixels", where)
    try:
        return Lens(int(header["screen_height"]), float(header["fov"])), pixels
    except OptionError as error:
        raise _damage(f"its levels were made for an impossible screen ({error})", where) from None


def _occluder(vertices: FloatArray, faces: IndexArray, error_bound: float, where: str) -> Occluder:
    try:
        mesh = TriangleMesh.from_soup(vertices, faces, where=where)
    except EmptyMeshError:
        return Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), error_bound)
    return Occluder(mesh.vertices, mesh.faces, error_bound)


def _pack(header: NDArray[np.void], rows: NDArray[np.void], occluders: list[Occluder]) -> bytes:
    corners = [one.vertices[one.faces].reshape(-1, 3) for one in occluders]
    origin = box_centre(np.concatenate(corners))
    blocks: list[bytes] = []
    end = _HEADER.itemsize + _align(rows.nbytes)

    def place(array: NDArray[np.generic]) -> int:
        nonlocal end
        begin, data = end, array.tobytes()
        blocks.append(data.ljust(_align(len(data)), b"\0"))
        end += len(blocks[-1])
        return begin

    low, high = np.full(3, np.inf, np.float32), np.full(3, -np.inf, np.float32)
    for row, occluder in zip(rows, occluders, strict=True):
        positions, faces = weld(to_float32(occluder.vertices - origin), occluder.faces)
        width = 2 if len(positions) <= MOST_SHORT else 4
        row["vertex_count"], row["triangle_count"] = len(positions), len(faces)
        row["index_bytes"] = width
        row["positions"] = place(positions.astype("<f4"))
        row["indices"] = place(faces.astype(f"<u{width}"))
        low = np.minimum(low, positions.min(axis=0, initial=np.inf))
        high = np.maximum(high, positions.max(axis=0, initial=-np.inf))
    header["magic"], header["version"] = MAGIC, OCC_VERSION
    header["flags"] = WELDED | SINGLE_SIDED * occluders[0].single_sided
    header["file_bytes"], header["level_count"] = end, len(rows)
    header["header_bytes"] = _HEADER.itemsize
    header["origin"] = origin
    if (low <= high).all():
        header["low"], header["high"] = low, high
    levels = rows.tobytes().ljust(_align(rows.nbytes), b"\0")
    return b"".join([header.tobytes(), levels, *blocks])


def _align(size: int) -> int:
    return -(-size // _ALIGNED) * _ALIGNED


def _open(data: bytes, where: str) -> tuple[np.void, NDArray[np.void]]:
    """The header and the table of levels, their figures checked and their blocks in the file."""
    check_start(data, len(data), where)
    header = np.frombuffer(data, dtype=_HEADER, count=1)[0]
    if header["version"] != OCC_VERSION:
        raise UnreadableMeshError(
            f"version {header['version']} of the format is not known",
            where=where,
            remedy=f"write version {OCC_VERSION}, or use a newer release",
        )
    size, count, begin = (
        int(header[name]) for name in ("file_bytes", "level_count", "header_bytes")
    )
    if size != len(data):
        raise _damage(f"it should have {size} bytes and has {len(data)}", where)
    if not 1 <= count <= MOST_LEVELS:
        raise _damage(f"it claims {count} levels of 1 to {MOST_LEVELS}", where)
    if begin < _HEADER.itemsize or begin % _ALIGNED or begin + count * _LEVEL.itemsize > size:
        raise _damage(f"its table of levels would begin at byte {begin}", where)
    if not np.isfinite(header["origin"]).all():
        raise _damage("its origin is not finite", where)
    rows = np.frombuffer(data, dtype=_LEVEL, count=count, offset=begin)
    for index, row in enumerate(rows):
        if not row["error_bound"] >= 0.0:
            raise _damage(f"the error bound of level {index} is {row['error_bound']}", where)
        if row["index_bytes"] not in (2, 4):
            raise _damage(f"level {index} has indices of {row['index_bytes']} bytes", where)
        for name, length in _lengths(row).items():
            offset = int(row[name])
            if offset < _HEADER.itemsize or offset % _ALIGNED or offset + length > size:
                raise _damage(
                    f"the {name} of level {index}, {length} bytes at {offset}, are not in the file",
                    where,
                )
    return header, rows


def _lengths(row: np.void) -> dict[str, int]:
    """Bytes of the blocks of a level."""
    return {
        "positions": 12 * int(row["vertex_count"]),
        "indices": 3 * int(row["index_bytes"]) * int(row["triangle_count"]),
    }


def _level_arrays(
    data: bytes, header: np.void, row: np.void, index: int, where: str
) -> tuple[FloatArray, IndexArray]:
    vertices, triangles = int(row["vertex_count"]), int(row["triangle_count"])
    positions = np.frombuffer(data, "<f4", 3 * vertices, int(row["positions"])).reshape(-1, 3)
    indices = np.frombuffer(data, f"<u{row['index_bytes']}", 3 * triangles, int(row["indices"]))
    if indices.max(initial=0) >= max(vertices, 1) or (triangles and not vertices):
        raise _damage(
            f"level {index} names vertex {indices.max()}, but there are {vertices}", where
        )
    with np.errstate(over="ignore", invalid="ignore"):
        world = positions.astype(np.float64) + header["origin"]
    return world, indices.astype(np.int64).reshape(-1, 3)


def _damage(what: str, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(what, where=where, remedy="copy or write it again")
