"""Wavefront OBJ: ``v`` and ``f`` statements, and the names that faces have; the rest is skipped.

The names that a Wavefront OBJ file gives its faces: ``o``, ``g`` and ``usemtl``.

Which materials of a Wavefront OBJ file one can see through, from the MTL files beside it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simplifier.errors import MeshError, UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.io.claim import Claim, Peek, estimate_matches
from simplifier.io.files import read_bytes
from simplifier.io.labels import Label, Labelled
from simplifier.io.places import is_file
from simplifier.io.polygons import triangles_by_polygon, triangulate_polygons
from simplifier.io.text import (
    line_number,
    named_lines,
    quote_word,
    read_statements,
    text_kernels,
    without_mark,
)

_VERTEX_LINE = re.compile(rb"(?im)^[ \t]*v[ \t](.*)$")
_FACE_LINE = re.compile(rb"(?im)^[ \t]*f[ \t](.*)$")


# A line that begins with a comment or with any word of the format's own.
_STATEMENT = re.compile(
    rb"(?:\A|[\r\n])[ \t\v\f]*(?:#|(?:v[tnp]?|f|l|p|o|g|s|mg|usemtl|mtllib|usemap|maplib|cstype|deg"
    rb"|bmat|step|curv2?|surf|parm|trim|hole|scrv|sp|end|con|bevel|c_interp|d_interp|lod|shadow_obj"
    rb"|trace_obj|ctech|stech|call|csh)(?=\s|\\|\Z))",
    re.IGNORECASE,
)


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what is no text, or other text."""
    text = without_mark(start).rstrip(b"\0")  # behind the end of a text zeros are harmless
    if not text or b"\0" in text:
        raise _no_obj("this is no text: it holds bytes of value 0", where)
    if _STATEMENT.search(text) is None and not text.isspace():
        raise _no_obj("no vertex and no face statement was found", where)


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 in file order and triangulated faces (m, 3) int64.

    Understood: ``v``, ``v/vt``, ``v//vn``, ``v/vt/vn``, indices that count back, lines joined by a
    backslash, comments, any line ending, any bytes in names.  Weights and colours after x y z are
    skipped.  Raises :class:`UnreadableMeshError`.
    """
    vertices, sizes, corners = _read_faces(without_mark(data), str(path))
    return vertices, triangulate_polygons(vertices, sizes, corners, where=str(path))


def decode_labelled(data: bytes, path: Path, allow_external: bool) -> Labelled:
    """As :func:`decode`, with names: ``o`` and ``g`` of objects, ``usemtl`` of materials.

    ``allow_external``  whether the MTL file is read, which alone says what can be seen through.
    """
    data = without_mark(data)
    vertices, sizes, corners = _read_faces(data, str(path))
    faces, counts = triangles_by_polygon(vertices, sizes, corners, where=str(path))
    runs, polygons, libraries = named_runs(data, str(path))
    before = np.concatenate([[0], np.cumsum(counts)])
    ends = before[np.cumsum(polygons)]
    see_through = see_through_materials(libraries, path) if allow_external else set()
    labels = [Label(run.objects, run.material, run.material in see_through) for run in runs]
    return Labelled(vertices, faces, labels, np.diff(ends, prepend=0).tolist())


def material_files(data: bytes, path: Path) -> list[str]:
    """The MTL files that :func:`decode_labelled` may look at."""
    said = [rest for _, _, rest in named_lines(without_mark(data), (b"mtllib",))]
    return library_files(said, path)


def _read_faces(data: bytes, where: str) -> tuple[FloatArray, IndexArray, IndexArray]:
    """Vertices, the corner count of each face, and the vertex indices of all corners."""
    vertices = read_statements(data, b"v", 3, where)
    sizes, corners = _read_corners(data, where)
    if len(vertices) == 0 and len(sizes) == 0 and _has_words(data):
        raise _no_obj("no vertex and no face statement was found", where)
    return vertices, sizes, corners


def claim(peek: Peek) -> Claim:
    """Vertices and corners of faces are estimated."""
    vertices, _ = estimate_matches(peek, _VERTEX_LINE)
    faces, corners = estimate_matches(peek, _FACE_LINE)
    triangles = max(corners - 2 * faces, 0)
    # The file and the vertices; then places of hard words, or sizes, starts and corners of faces.
    numbers = max(24 * vertices, (8 + 16) * faces + (8 + 3) * corners)
    if corners != 3 * faces:  # each size is triangulated by itself
        numbers += 16 * corners + 24 * triangles
    return Claim(vertices, triangles, peek.size + 24 * vertices + numbers)


def _no_obj(what: str, where: str) -> UnreadableMeshError:
    return UnreadableMeshError(what, where=where, remedy="check that this is a Wavefront OBJ file")


def _read_corners(data: bytes, where: str) -> tuple[IndexArray, IndexArray]:
    """Corner count of each face, and the vertex indices of all corners."""
    text = np.frombuffer(data, dtype=np.uint8)
    faces, count = text_kernels().count_obj_corners(text)
    sizes = np.empty(faces, dtype=np.int64)
    corners = np.empty(count, dtype=np.int64)
    wrong = text_kernels().read_obj_corners(text, sizes, corners)
    if wrong >= 0:
        word = (data[wrong : wrong + 64].split() or [b""])[0]
        raise UnreadableMeshError(
            f"line {line_number(data, wrong)}: {quote_word(word)} is not the index of a vertex",
            where=where,
            remedy="indices are whole numbers from 1, or from -1 backwards",
        )
    return sizes, corners


def _has_words(data: bytes) -> bool:
    words, _ = text_kernels().count_words(np.frombuffer(data, dtype=np.uint8), 0)
    return bool(words > 0)


def encode(occluder: Occluder, *polygons: IntArray) -> bytes:
    """Text with the shortest digits that give back the same float64.

    ``polygons``  (k, n) faces of n corners, in place of the occluder's own.
    """
    lines = ["# planar-occluder"]
    lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in occluder.vertices.tolist()]
    for faces in polygons or (occluder.faces,):
        lines += [f"f {' '.join(map(str, face))}" for face in (faces + 1).tolist()]
    return "\n".join([*lines, ""]).encode("ascii")


_MOST_GROUPS = 64  # that a face is in at once: all are looked at again for each new material


@dataclass(frozen=True)
class Named:
    """What is in force from a byte of the file on: object, groups, and material."""

    objects: tuple[str, ...]
    material: str


def named_runs(data: bytes, where: str) -> tuple[list[Named], IndexArray, list[str]]:
    """The names in force, run by run; the faces (polygons) of each run; what ``mtllib`` says.

    Empty objects and materials stand for none; the first run begins with the file.  Raises
    :class:`UnreadableMeshError` for faces in more than :data:`_MOST_GROUPS` groups at once.
    """
    libraries: list[str] = []
    runs, begins = [Named((), "")], [0]
    title, groups, material = "", tuple[str, ...](), ""
    for begin, keyword, rest in named_lines(data, (b"o", b"g", b"usemtl", b"mtllib")):
        match keyword:
            case b"mtllib":
                libraries.append(rest)
                continue
            case b"o":
                title = rest
            case b"g":
                groups = tuple(rest.split())
                if len(groups) > _MOST_GROUPS:
                    raise UnreadableMeshError(
                        f"line {line_number(data, begin)}: names {len(groups):,} groups at once,"
                        f" more than {_MOST_GROUPS}",
                        where=where,
                        remedy="put faces into fewer groups",
                    )
            case _:
                material = rest
        objects = tuple(dict.fromkeys(name for name in (title, *groups) if name))
        runs.append(Named(objects, material))
        begins.append(begin)
    text = np.frombuffer(data, dtype=np.uint8)
    ends = [*begins[1:], len(data)]
    faces = [
        text_kernels().count_obj_corners(text[begin:end])[0]
        for begin, end in zip(begins, ends, strict=True)
    ]
    return runs, np.array(faces, dtype=np.int64), libraries


_PARTS = re.compile(r"[/\\]")


def see_through_materials(libraries: list[str], mesh: Path) -> set[str]:
    """The names of materials with ``d`` below 1, ``Tr`` between 0 and 1 or a ``map_d``.

    ``Tr`` is transparency to some programs, and opacity to others (MeshLab before 2023.12,
    CloudCompare before 2.11).  A value of 1 is opaque here, since nobody exports a surface that
    cannot be seen.

    ``libraries``  what ``mtllib`` statements of ``mesh`` say: a name, or several.  Only files under
    the mesh's folder are opened; one that is not there, or cannot be read, says nothing: OBJ files
    are often passed on without it.
    """
    found: set[str] = set()
    for said in dict.fromkeys(libraries):
        for path in _files(said, mesh.parent.resolve()):
            try:
                found |= _see_through(read_bytes(path))
            except MeshError:
                continue
    return found


def library_files(libraries: list[str], mesh: Path) -> list[str]:
    """What is looked for to that end, there or not: names relative to the mesh's folder."""
    folder = mesh.parent.resolve()
    names = dict.fromkeys(name for said in libraries for name in (said, *said.split()))
    paths = dict.fromkeys(_beside(name, folder) for name in names)
    return [path.relative_to(folder).as_posix() for path in paths if path not in (None, folder)]


def _files(said: str, folder: Path) -> Iterator[Path]:
    """One name, which may hold blanks, or else several."""
    whole = _beside(said, folder)
    if whole is not None and is_file(whole):
        yield whole
        return
    for name in said.split():
        path = _beside(name, folder)
        if path is not None:
            yield path


def _beside(name: str, folder: Path) -> Path | None:
    """None for what leads out of the folder: a mesh from elsewhere must not have others read."""
    try:
        path = folder.joinpath(*_PARTS.split(name)).resolve()
    except (OSError, ValueError, RuntimeError):  # a NUL character, a loop of links
        return None
    return path if path.is_relative_to(folder) else None


def _see_through(data: bytes) -> set[str]:
    found: set[str] = set()
    material = ""
    for _, keyword, rest in named_lines(data, (b"newmtl", b"d", b"Tr", b"map_d")):
        match keyword:
            case b"newmtl":
                material = rest
            case b"map_d":
                found.add(material)
            case b"d":
                found |= {material} if _last_number(rest, 1.0) < 1.0 else set()
            case _:
                found |= {material} if 0.0 < _last_number(rest, 0.0) < 1.0 else set()
    return found


def _last_number(text: str, otherwise: float) -> float:
    """``-halo 0.5`` is 0.5; what is no number counts as ``otherwise``."""
    try:
        return float(text.split()[-1])
    except (ValueError, IndexError):
        return otherwise
