"""COLLADA, ``.dae``: all meshes of the scene in world coordinates, float64.

Coordinates are taken as they are: neither the unit nor the axis that the file calls up is applied.
Of a skin the shape is read in which it was bound to its bones.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.io.collada_mesh import read_mesh
from simplifier.io.labels import Labelled
from simplifier.io.objects import Objects
from simplifier.io.placing import Material, NamedMesh, Placed
from simplifier.io.text import without_mark
from simplifier.io.xml_text import parse_xml, read_floats

_DEEPEST = 100  # nodes within nodes
_MOST_PLACES = 100_000
_EXPORT = "copy or export it again"

Bound = tuple[tuple[str, str], ...]
"""Symbols of a mesh's materials, each with the address of what it stands for."""


def check_start(start: bytes, size: int, where: str) -> None:
    """Raises :class:`UnreadableMeshError` for what is not XML."""
    if not without_mark(start).lstrip().startswith(b"<"):
        raise UnreadableMeshError(
            "this is not XML, which a COLLADA file is", where=where, remedy=_EXPORT
        )


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) int64, in the order of the scene's nodes.

    Raises :class:`UnreadableMeshError`, also for a file that refers to others: none is opened.
    """
    found = decode_labelled(data, path, allow_external=False)
    return found.vertices, found.faces


def decode_labelled(data: bytes, path: Path, allow_external: bool) -> Labelled:
    """As :func:`decode`, with the names of nodes, meshes and materials."""
    return _Document(data, str(path)).placed().labelled(str(path))


def objects(data: bytes, path: Path, see_through: bool) -> Objects:
    """An object for every mesh at every place; ``see_through`` says whether such is taken."""
    return _Document(data, str(path)).placed().objects(see_through)


class _Document:
    """The tree of a file, its elements by their ids."""

    def __init__(self, data: bytes, where: str) -> None:
        self.where = where
        self._length = len(data)
        self._read = 0  # vertices
        self._meshes: dict[int, tuple[FloatArray, IndexArray, list[tuple[str, int]]]] = {}
        self._bounds: dict[int, Bound] = {}
        self._same_bounds: dict[Bound, Bound] = {(): ()}
        self._nodes: dict[int, tuple[FloatArray, list[Element]]] = {}
        self._materials: dict[str, Material] = {}
        self.root = parse_xml(data, where)
        if self.root.tag != "COLLADA":
            raise self._wrong(f"the XML is a <{self.root.tag[:40]}>, no COLLADA", "check the file")
        self._by_id: dict[str, Element] = {}
        for element in self.root.iter():
            self._by_id.setdefault(element.get("id", ""), element)

    def placed(self) -> Placed:
        """What the scene shows."""
        numbers: dict[tuple[int, int], int] = {}
        meshes: list[NamedMesh] = []
        mesh_of: list[int] = []
        transforms: list[FloatArray] = []
        names: list[tuple[str, ...]] = []
        for geometry, bound, transform, owners in self._instances():
            key = id(geometry), id(bound)
            if key not in numbers:
                numbers[key] = len(meshes)
                meshes.append(self._named_mesh(geometry, dict(bound)))
            if meshes[numbers[key]].runs:
                mesh_of.append(numbers[key])
                transforms.append(transform)
                mine = dict.fromkeys(name for name in (*owners, _name(geometry)) if name)
                names.append(tuple(mine) or ("mesh",))
        return Placed(meshes, mesh_of, transforms, names)

    def _instances(self) -> Iterator[tuple[Element, Bound, FloatArray, tuple[str, ...]]]:
        """Geometries with their materials and transforms, and the names of their nodes."""
        visits = 0
        waiting: list[tuple[Element, FloatArray, tuple[str, ...]]] = [
            (root, np.eye(4), ()) for root in reversed(self._roots())
        ]
        while waiting:
            element, outer, owners = waiting.pop()
            visits += 1
            if visits > _MOST_PLACES or len(owners) > _DEEPEST:
                raise self._wrong(
                    f"its nodes are nested in a circle, deeper than {_DEEPEST}, or placed more than"
                    f" {_MOST_PLACES} times",
                    "export the scene as a single mesh",
                )
            if element.tag == "geometry":
                yield element, self._same_bounds[()], outer, ()
            elif element.tag == "instance_geometry":
                geometry = self._target(element, "url", "geometry")
                yield geometry, self._bound(element), outer, owners
            elif element.tag == "instance_controller":
                shape, transform = self._bound_shape(element)
                yield shape, self._bound(element), transform, owners
            else:
                node = element
                if element.tag == "instance_node":
                    node = self._target(element, "url", "node")
                own, children = self._node(node)
                inner = composed(outer, own)
                mine = (_name(node), *owners)
                waiting += [(child, inner, mine) for child in children]

    def _node(self, node: Element) -> tuple[FloatArray, list[Element]]:
        """Its transform, and what it places, the last first; read once, however often it stands."""
        if id(node) not in self._nodes:
            children = [child for child in reversed(node) if child.tag in _PLACING]
            self._nodes[id(node)] = node_transform(node, self.where), children
        return self._nodes[id(node)]

    def _bound(self, instance: Element) -> Bound:
        """The same object for equal ones, so that no place compares them again."""
        if id(instance) not in self._bounds:
            found = tuple(
                (one.get("symbol", ""), one.get("target", ""))
                for one in instance.iter("instance_material")
            )
            self._bounds[id(instance)] = self._same_bounds.setdefault(found, found)
        return self._bounds[id(instance)]

    def _roots(self) -> list[Element]:
        """The nodes of the scene that is shown; without a scene the meshes as they are."""
        shown = self.root.find("scene/instance_visual_scene")
        if shown is not None:
            return self._target(shown, "url", "visual_scene").findall("node")
        scene = self.root.find("library_visual_scenes/visual_scene")
        if scene is not None:
            return scene.findall("node")
        return self.root.findall("library_geometries/geometry")

    def _bound_shape(self, instance: Element) -> tuple[Element, FloatArray]:
        """The mesh of a skin or a morph, and where it was bound to its bones."""
        controller = self._target(instance, "url", "controller")
        transform = np.eye(4)
        for _ in range(_DEEPEST):
            shape = controller.find("skin")
            if shape is None:
                shape = controller.find("morph")
            if shape is None:
                raise self._wrong("a <controller> has neither skin nor morph", _EXPORT)
            matrix = shape.find("bind_shape_matrix")
            if matrix is not None:
                bound = read_transform(matrix, "matrix", self.where)
                transform = composed(transform, bound)
            found = self._target(shape, "source", "geometry", "controller")
            if found.tag == "geometry":
                return found, transform
            controller = found
        raise self._wrong("its controllers refer to each other in a circle", _EXPORT)

    def _named_mesh(self, geometry: Element, bound: dict[str, str]) -> NamedMesh:
        vertices, faces, symbols = self._mesh(geometry)
        runs = [
            (self._material(bound[symbol]) if symbol in bound else Material(symbol), count)
            for symbol, count in symbols
        ]
        return NamedMesh((vertices, faces), runs)

    def _mesh(self, geometry: Element) -> tuple[FloatArray, IndexArray, list[tuple[str, int]]]:
        """Read once, whatever materials are bound to it."""
        if id(geometry) not in self._meshes:
            found = read_mesh(geometry, self._by_id, self.where)
            self._meshes[id(geometry)] = found
            self._read += len(found[0])
            if self._read > self._length:
                raise self._wrong(
                    "its meshes share their vertices until they are more than the file has bytes",
                    "export the scene as a single mesh",
                )
        return self._meshes[id(geometry)]

    def _material(self, address: str) -> Material:
        """Of an address within the file; one that leads nowhere has that for its name."""
        if address not in self._materials:
            self._materials[address] = self._read_material(address)
        return self._materials[address]

    def _read_material(self, address: str) -> Material:
        material = self._by_id.get(address.removeprefix("#"))
        if material is None or material.tag != "material":
            return Material(address.removeprefix("#"))
        instance = material.find("instance_effect")
        effect = None if instance is None else self._by_id.get(instance.get("url", "")[1:])
        see_through = effect is not None and _is_see_through(effect, self.where)
        return Material(_name(material), see_through)

    def _target(self, element: Element, attribute: str, *tags: str) -> Element:
        """What the address in an attribute leads to.  Other files are not opened."""
        address = element.get(attribute, "")
        if not address.startswith("#"):
            raise self._wrong(
                f"<{element.tag}> refers to another file, '{address[:60]}', which is not opened",
                "export all into a single file",
            )
        found = self._by_id.get(address[1:])
        if found is None or found.tag not in tags:
            raise self._wrong(
                f"<{element.tag}> refers to '{address[:60]}', and there is no such <{tags[0]}>",
                _EXPORT,
            )
        return found

    def _wrong(self, what: str, remedy: str) -> UnreadableMeshError:
        return UnreadableMeshError(what, where=self.where, remedy=remedy)


_PLACING = ("node", "instance_node", "instance_geometry", "instance_controller")


def _name(element: Element) -> str:
    return element.get("name") or element.get("id") or ""


def _is_see_through(effect: Element, where: str) -> bool:
    """By ``transparent`` and ``transparency`` as COLLADA 1.4 and 1.5 define them."""
    transparent = effect.find(".//transparent")
    if transparent is None:
        return False
    colour = transparent.find("color")
    if colour is None:
        return transparent.find("texture") is not None
    amount = effect.find(".//transparency/float")
    factor = read_floats(amount, where) if amount is not None else np.ones(1)
    red, green, blue, alpha = np.resize(np.append(read_floats(colour, where), [1.0] * 4), 4)
    by_colour = 0.212671 * red + 0.715160 * green + 0.072169 * blue
    share = float(factor[0]) if len(factor) else 1.0
    opacity = {
        "A_ZERO": 1.0 - alpha * share,
        "RGB_ONE": by_colour * share,
        "RGB_ZERO": 1.0 - by_colour * share,
    }.get(transparent.get("opaque", "A_ONE"), alpha * share)
    return bool(opacity < 1.0 - 1e-6)


_SIZES = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4, "lookat": 9}


def node_transform(node: Element, where: str) -> FloatArray:
    """(4, 4), from the node's space to that of its parent: its transforms, the first outermost.

    Raises :class:`UnreadableMeshError` for one that is not understood.
    """
    total = np.eye(4)
    for child in node:
        if child.tag == "skew":
            raise UnreadableMeshError(
                "a node is skewed, which is not understood",
                where=where,
                remedy="apply the transforms before the export",
            )
        if child.tag in _SIZES:
            total = composed(total, read_transform(child, child.tag, where))
    return total


def composed(outer: FloatArray, inner: FloatArray) -> FloatArray:
    """Both, the inner one first; not finite where they lead beyond all numbers."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(outer @ inner)


def read_transform(element: Element, kind: str, where: str) -> FloatArray:
    """(4, 4) of one transform; not finite where its numbers mean nothing."""
    numbers = read_floats(element, where)
    if len(numbers) != _SIZES[kind]:
        raise UnreadableMeshError(
            f"<{element.tag}> has {len(numbers)} numbers instead of {_SIZES[kind]}",
            where=where,
            remedy="copy or export it again",
        )
    result = np.eye(4)
    if kind == "matrix":
        return numbers.reshape(4, 4)
    if kind == "translate":
        result[:3, 3] = numbers
    elif kind == "scale":
        result[:3, :3] = np.diag(numbers)
    elif kind == "rotate":
        result[:3, :3] = _rotation(numbers[:3], np.radians(numbers[3]))
    else:
        result[:3] = _lookat(numbers[:3], numbers[3:6], numbers[6:])
    return result


def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Rodrigues' formula; none around an axis without a length."""
    if not axis.any():
        return np.eye(3)
    x, y, z = _unit(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    with np.errstate(invalid="ignore", over="ignore"):
        turned = np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return np.asarray(np.eye(3) + turned)


def _lookat(eye: FloatArray, interest: FloatArray, up: FloatArray) -> FloatArray:
    """(3, 4): right, up, backwards and the place of one who looks from ``eye``."""
    with np.errstate(invalid="ignore", over="ignore"):
        back = _unit(eye - interest)
        right = _unit(np.cross(up, back))
        return np.stack([right, np.cross(back, right), back, eye], axis=1)


def _unit(vector: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        return np.asarray(vector / np.linalg.norm(vector))
