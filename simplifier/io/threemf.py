"""3MF: what the model in the archive builds, in world coordinates, float64.

Objects are meshes, or components that place other objects, also of other models in the archive; the
items of the build place objects in the world.  What the build does not place is not there.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
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
from simplifier.io.xml_text import Attributes

_DEEPEST = 50  # components within components
_MOST_PLACES = 100_000
_EXPORT = "copy or export it again"
_KNOWN = ("/production/", "/material/", "/slice/", "/trianglesets/")
"""In the addresses of extensions without which the triangles are the same."""

Place = tuple[str, str]
"""A model's name in lower case and an object's number."""


@dataclass(frozen=True)
class Reference:
    """An object that stands somewhere."""

    place: Place
    transform: FloatArray


@dataclass
class Resource:
    """An object of a model: a mesh, or other objects.

    ``runs``  for its triangles: the number of a group of materials, the place in it, and how many
    triangles in a row have that.
    """

    name: str
    corners: array[float] = field(default_factory=lambda: array("d"))
    triangles: array[int] = field(default_factory=lambda: array("q"))
    runs: list[tuple[str, str, int]] = field(default_factory=list)
    components: list[Reference] = field(default_factory=list)


@dataclass
class Model:
    """What one XML part of the archive holds."""

    objects: dict[str, Resource] = field(default_factory=dict)
    materials: dict[str, list[Material]] = field(default_factory=dict)
    items: list[Reference] = field(default_factory=list)


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what is no ZIP archive."""
    if not start.startswith(b"PK\x03\x04"):
        raise UnreadableMeshError(
            "this is no ZIP archive, which a 3MF file is", where=where, remedy=_EXPORT
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
    models = {main: _read_model(archive, main)}
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
        if visits > _MOST_PLACES or len(owners) > _DEEPEST:
            raise UnreadableMeshError(
                f"its objects are nested in a circle, deeper than {_DEEPEST}, or placed more than"
                f" {_MOST_PLACES} times",
                where=archive.where,
                remedy="export the model as a single mesh",
            )
        model, number = reference.place
        if model not in models:
            models[model] = _read_model(archive, model)
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


def _read_model(archive: Archive, name: str) -> Model:
    reader = _ModelReader(name, f"{archive.where}: {name}")
    archive.walk(name, reader.begin, reader.end, reader.namespaces.__setitem__)
    return reader.model


class _ModelReader:
    """Builds a :class:`Model` from the elements of its XML, as they come."""

    def __init__(self, name: str, where: str) -> None:
        self.model = Model()
        self.namespaces: dict[str | None, str | None] = {}
        self._name, self._where = name, where
        self._inside: list[str] = []
        self._object: Resource | None = None
        self._own = "", ""  # group and place of the object's material
        self._materials: list[Material] = []

    def begin(self, name: str, own: Attributes) -> None:
        outer = self._inside[-1] if self._inside else ""
        self._inside.append(name)
        try:
            if name == "vertex" and outer == "vertices":
                self._vertex(own)
            elif name == "triangle" and outer == "triangles":
                self._triangle(own)
            else:
                self._other(name, outer, own)
        except KeyError as error:
            raise self._wrong(f"<{name}> has no {error}") from None
        except (ValueError, OverflowError) as error:
            raise self._wrong(f"<{name}>: {str(error)[:100]}") from None

    def end(self, name: str) -> None:
        self._inside.pop()
        if name == "object":
            self._object = None

    def _vertex(self, own: Attributes) -> None:
        if self._object is not None and self._inside[-3] == "mesh":
            self._object.corners.extend((float(own["x"]), float(own["y"]), float(own["z"])))

    def _triangle(self, own: Attributes) -> None:
        if self._object is None or self._inside[-3] != "mesh":
            return
        self._object.triangles.extend((int(own["v1"]), int(own["v2"]), int(own["v3"])))
        group, place = own.get("pid", self._own[0]), own.get("p1", self._own[1])
        runs = self._object.runs
        if runs and runs[-1][:2] == (group, place):
            runs[-1] = (group, place, runs[-1][2] + 1)
        else:
            runs.append((group, place, 1))

    def _other(self, name: str, outer: str, own: Attributes) -> None:
        if name == "object" and outer == "resources":
            self._begin_object(own)
        elif name == "component" and self._object is not None:
            self._object.components.append(self._reference(own))
        elif name == "item" and outer == "build":
            self.model.items.append(self._reference(own))
        elif name in ("basematerials", "colorgroup"):
            self._materials = self.model.materials.setdefault(own["id"], [])
        elif name == "base" and outer == "basematerials":
            colour = own.get("displaycolor", "")
            self._materials.append(Material(own.get("name", ""), _is_see_through(colour)))
        elif name == "color" and outer == "colorgroup":
            self._materials.append(Material("", _is_see_through(own.get("color", ""))))
        elif name == "model":
            self._check_extensions(own.get("requiredextensions", "").split())

    def _begin_object(self, own: Attributes) -> None:
        number = own["id"]
        if number in self.model.objects:
            raise self._wrong(f"two objects have the number {number[:40]!r}")
        self._own = own.get("pid", ""), own.get("pindex", "")
        self._object = self.model.objects[number] = Resource(own.get("name") or f"object {number}")

    def _reference(self, own: Attributes) -> Reference:
        path = next((value for key, value in own.items() if key.endswith("}path")), self._name)
        transform = np.eye(4)
        if "transform" in own:
            rows = np.array([float(word) for word in own["transform"].split()]).reshape(4, 3)
            transform[:3] = rows.T
        return Reference((path.lstrip("/").lower(), own["objectid"]), transform)

    def _check_extensions(self, prefixes: list[str]) -> None:
        for prefix in prefixes:
            address = self.namespaces.get(prefix) or prefix
            if not any(known in address for known in _KNOWN):
                raise self._wrong(f"it needs the extension '{address[:80]}', which is not read")

    def _wrong(self, what: str) -> UnreadableMeshError:
        return UnreadableMeshError(what, where=self._where, remedy=_EXPORT)


def _is_see_through(colour: str) -> bool:
    """Of ``#rrggbb`` or ``#rrggbbaa``."""
    return len(colour) == 9 and colour[7:].lower() != "ff"


_STRUCTURE = re.compile(rb"<(?:[\w.-]+:)?(object|component|item)\s([^>]*)>")
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
    # The file; all numbers, as they are read and as an array; and the places, each and all in one.
    own = sum_sizes(outline.sizes.values())
    return Claim(vertices, triangles, peek.size + 48 * (sum(own) + vertices + triangles))


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
        if depth > _DEEPEST:
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
