"""Godot 4 ``ArrayOccluder3D`` as a text resource (.tres).

Godot's y points up and its unit is the metre; coordinates are passed on as they are.  Occluders are
double-sided there, so the winding does not matter.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.weld import weld
from simplifier.io.claim import Claim, Peek
from simplifier.io.polygons import triangulate_polygons
from simplifier.io.text import read_numbers, without_mark

_HEADER = re.compile(rb"\s*\[gd_resource\b([^\]]*)\]")
_TYPE = re.compile(rb'\btype\s*=\s*"([^"]*)"')
_ARRAY = r"(?:\A|\n)[ \t]*%s[ \t]*=[ \t]*%s\(([^()]*)(\)?)"


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` unless it begins with a header, or with white space."""
    text = without_mark(start).lstrip()
    if text and not text.startswith(b"[gd_resource"):
        raise _no_occluder("no [gd_resource type=…] header", where)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) int64; an absent array is an empty one, as in Godot.

    Raises :class:`UnreadableMeshError`, also for other types of resource.
    """
    where = str(path)
    text = without_mark(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    header = _HEADER.match(text)
    kind = _TYPE.search(header[1]) if header else None
    if kind is None or kind[1] != b"ArrayOccluder3D":
        found = kind[1].decode("latin-1")[:40] if kind else "no [gd_resource type=…] header"
        raise _no_occluder(found, where)
    vertices = _array(text, "vertices", "PackedVector3Array", where).reshape(-1, 3)
    indices = _array(text, "indices", "PackedInt32Array", where)
    corners = indices.astype(np.int64)
    sizes = np.full(len(corners) // 3, 3, dtype=np.int64)
    return vertices, triangulate_polygons(vertices, sizes, corners, where=where)


def claim(peek: Peek) -> Claim:
    """Estimated from what the text of a vertex and of two triangles takes."""
    vertices = peek.size // 100
    triangles = 2 * vertices
    # The text and one without commas; numbers and places of hard ones; indices twice as int64.
    return Claim(vertices, triangles, 3 * peek.size + 40 * vertices + 100 * triangles)


def _no_occluder(found: str, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(
        f"not a Godot ArrayOccluder3D (found: {found})",
        where=where,
        remedy="export the mesh itself as .glb",
    )


def _array(text: bytes, name: str, kind: str, where: str) -> FloatArray:
    """The numbers of one packed array; their count must be a multiple of three."""
    found = re.search((_ARRAY % (name, kind)).encode("ascii"), text)
    if found is None:
        if re.search(rb"\n[ \t]*" + name.encode("ascii") + rb"[ \t]*=", text):
            raise UnreadableMeshError(f"'{name}' is not a {kind}", where=where)
        return np.empty(0)
    if not found[2]:
        raise UnreadableMeshError(f"the file is truncated inside '{name}'", where=where)
    numbers = found[1].replace(b",", b" ").replace(b"inf_neg", b"-inf")
    values = read_numbers(numbers, f"{where}: {name}").values
    whole = kind == "PackedVector3Array" or bool(
        ((np.abs(values) < 2**31) & (values == np.floor(values))).all()
    )
    if len(values) % 3 or not whole:
        fault = "is not a whole number of triples" if whole else "holds other than whole numbers"
        raise UnreadableMeshError(f"'{name}' {fault}", where=where)
    return values


def encode(occluder: Occluder) -> bytes:
    """Text with the shortest digits that give back the same float64.

    Godot itself rounds them to float32, except in builds with ``precision=double``.  Corners in the
    same place are one vertex: Godot transforms each for every frame.
    """
    welded, faces = weld(occluder.vertices, occluder.faces)
    vertices = ", ".join(map(repr, welded.ravel().tolist()))
    indices = ", ".join(map(str, faces.ravel().tolist()))
    return (
        '[gd_resource type="ArrayOccluder3D" format=3]\n\n[resource]\n'
        f"vertices = PackedVector3Array({vertices})\n"
        f"indices = PackedInt32Array({indices})\n"
    ).encode("ascii")
