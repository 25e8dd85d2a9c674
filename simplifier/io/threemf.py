"""3MF: what the model in the archive builds, in world coordinates, float64.

Objects are meshes, or components that place other objects, also of other models in the archive; the
items of the build place objects in the world.  What the build does not place is not there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.io.claim import Claim, Peek
from simplifier.io.labels import Labelled
from simplifier.io.objects import Objects
from simplifier.io.placing import MOST_TRIANGLES, Material, NamedMesh, Placed, Size, sum_sizes
from simplifier.io.polygons import triangulate_polygons
from simplifier.io.threemf_archive import Archive
from simplifier.io.threemf_model import DEEPEST, Model, Place, Reference, Resource, read_model

_MOST_PLACES = 100_000
_EXPORT = "copy or export it again"


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what is not a ZIP archive."""
    if not start.startswith(b"PK\x03\x04"):
        raise UnreadableMeshError(
            "this is not a ZIP archive, which a 3MF file is", where=where, remedy=_EXPORT
        )


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) int64, in the order of the build.

    The numbers are taken as they are, whatever unit the model names.  Raises
    :class:`UnreadableMeshError`.
    """
    found = decode_labelled(data, path, allow_external=False)
    return found.vertices, found.faces


def decode_labelled(data: bytes, path: Path, allow_external: bool) -> Labelled:
    """As :func:`decode`, with the names of objects and materials; no other file is ever opened."""
    return _read(data, str(path)).labelled(str(path))


def objects(data: bytes, path: Path, see_through: bool) -> Objects:
    """An object for every mesh at every place; ``see_through`` says whether such is taken."""
    return _read(data, str(path)).objects(see_through)


def _read(data: bytes, where: str) -> Placed:
    archive = Archive(BytesIO(data), where)
    main = archive.main_model()
    models = {main: read_model(archive, main)}
    meshes: dict[Place, int] = {}
    found: list[NamedMesh] = []
    mesh_of: list[int] = []
    transforms: list[FloatArray] = []
    names: list[tuple[str, ...]] = []
    for place, transform, owners in _placed(archive, models, main):
        if place not in meshes:
            meshes[place] = len(found)
            found.append(_named_mesh(models[place[0]], models[place[0]].objects[place[1]], where))
        mesh_of.append(meshes[place])
        transforms.append(transform)
        names.append(owners)
    return Placed(found, mesh_of, transforms, names)


def _placed(
    archive: Archive, models: dict[str, Model], main: str
) -> Iterator[tuple[Place, FloatArray, tuple[str, ...]]]:
    """Meshes with their transforms and the names of what they belong to, the nearest first.

    Models that components refer to are read when they are met, and put into ``models``.
    """
    visits = 0
    stack: list[tuple[Reference, FloatArray, tuple[str, ...]]] = [
        (item, np.eye(4), ()) for item in reversed(models[main].items)
    ]
    while stack:
        reference, outer, owners = stack.pop()
        visits += 1
        if visits > _MOST_PLACES or len(owners) > DEEPEST:
            raise UnreadableMeshError(
                f"its objects are nested in a circle, deeper than {DEEPEST}, or placed more than"
                f" {_MOST_PLACES} times",
                where=archive.where,
                remedy="export the model as a single mesh",
            )
        model, number = reference.place
        if model not in models:
            models[model] = read_model(archive, model)
        one = models[model].objects.get(number)
        if one is None:
            raise UnreadableMeshError(
                f"there is no object {number[:40]!r} in '{model[:60]}', which is to be placed",
                where=archive.where,
                remedy=_EXPORT,
            )
        with np.errstate(invalid="ignore", over="ignore"):
            transform = outer @ reference.transform
        inner = (one.name, *owners)
        if one.triangles:
            yield reference.place, transform, tuple(dict.fromkeys(inner))
        stack += [(each, transform, inner) for each in reversed(one.components)]


def _named_mesh(model: Model, one: Resource, where: str) -> NamedMesh:
    points = np.array(one.corners, dtype=np.float64).reshape(-1, 3)
    corners = np.array(one.triangles, dtype=np.int64)
    sizes = np.full(len(corners) // 3, 3, dtype=np.int64)
    faces = triangulate_polygons(points, sizes, corners, where=where)
    runs = [(_material(model, group, place), count) for group, place, count in one.runs]
    return NamedMesh((points, faces), runs)


def _material(model: Model, group: str, place: str) -> Material:
    found = model.materials.get(group, [])
    return found[int(place)] if place.isdecimal() and int(place) < len(found) else Material()


_STRUCTURE = re.compile(rb"<(?:[\w.-]+:)?(object|component|item)\s([^<>]*)>")
_NUMBER = re.compile(rb"\b(?:object)?id\s*=\s*[\"']([^\"']*)")
_PATH = re.compile(rb"\bpath\s*=\s*[\"']/?([^\"']*)")
_PIECE = 1 << 20  # bytes
_LONGEST_TAG = 1 << 24


def claim(peek: Peek) -> Claim:
    """Elements are counted in the text of the models, each time that the build places them."""
    archive = Archive(peek.path, str(peek.path))
    outline = _Outline(archive)
    main = archive.main_model()
    vertices, triangles = sum_sizes(outline.total(place) for place in outline.items.get(main, []))
    if max(vertices, triangles) > MOST_TRIANGLES:  # reading refuses it before all are in one
        vertices = triangles = 0
    # The file; all numbers, as they are read and as an array, which take no more than the text does
    # where that is written so that nothing is counted; and the places, each and all in one.
    own = max(48 * sum(sum_sizes(outline.sizes.values())), archive.unpacked)
    return Claim(vertices, triangles, peek.size + own + 48 * (vertices + triangles))


class _Outline:
    """How much each object of an archive holds, and what it is made of."""

    def __init__(self, archive: Archive) -> None:
        self.sizes: dict[Place, Size] = {}
        self.items: dict[str, list[Place]] = {}
        self._parts: dict[Place, list[Place]] = {}
        self._totals: dict[Place, Size] = {}
        for model in archive.models():
            current = model, ""
            for kind, place, size in _structure(archive, model):
                self.sizes[current] = sum_sizes([self.sizes.get(current, (0, 0)), size])
                if kind == b"object":
                    current = place
                elif kind == b"component":
                    self._parts.setdefault(current, []).append(place)
                elif kind == b"item":
                    self.items.setdefault(model, []).append(place)

    def total(self, place: Place, depth: int = 0) -> Size:
        """Of an object with all that it places; those too deep count not, for reading refuses
        them."""
        if depth > DEEPEST:
            return 0, 0
        if place not in self._totals:
            parts = [self.total(part, depth + 1) for part in self._parts.get(place, [])]
            self._totals[place] = sum_sizes([self.sizes.get(place, (0, 0)), *parts])
        return self._totals[place]


def _structure(archive: Archive, model: str) -> Iterator[tuple[bytes, Place, Size]]:
    """Of each tag that matters its kind, its object, and the elements that stand before it."""
    with archive.open(model) as part:
        rest = b""
        while piece := archive.read(part, _PIECE):
            text = rest + piece
            end = max(text.rfind(b"<"), 0)
            text, rest = text[:end], text[end:] if len(text) - end < _LONGEST_TAG else b""
            begin = 0
            for tag in _STRUCTURE.finditer(text):
                yield tag[1], _place(tag[2], model), _elements(text, begin, tag.start())
                begin = tag.end()
            yield b"", (model, ""), _elements(text, begin, len(text))


def _place(attributes: bytes, model: str) -> Place:
    number, path = _NUMBER.search(attributes), _PATH.search(attributes)
    return (
        path[1].decode("utf-8", "replace").lower() if path else model,
        number[1].decode("utf-8", "replace") if number else "",
    )


def _elements(text: bytes, begin: int, end: int) -> Size:
    return text.count(b"<vertex ", begin, end), text.count(b"<triangle ", begin, end)
