"""One model of a 3MF archive: its objects, materials and items, from the elements of its XML."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.placing import Material
from simplifier.io.threemf_archive import Archive
from simplifier.io.xml_text import Attributes

DEEPEST = 50  # components within components
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


def read_model(archive: Archive, name: str) -> Model:
    """Raises :class:`UnreadableMeshError` for one that is damaged or needs what is not read."""
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
