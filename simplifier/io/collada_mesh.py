"""The triangles of a COLLADA geometry, from polygons, strips and fans, and their materials."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import MutableMapping
from xml.etree.ElementTree import Element

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.io.polygons import fan_triangles, strip_triangles, triangulate_polygons
from simplifier.io.xml_text import read_floats, read_integers

_EXPORT = "copy or export it again"
_KINDS = ("triangles", "polylist", "polygons", "tristrips", "trifans")
Ids = MutableMapping[str, Element]
"""Elements by their ids."""


def read_mesh(
    geometry: Element, ids: Ids, where: str
) -> tuple[FloatArray, IndexArray, list[tuple[str, int]]]:
    """Vertices (n, 3) float64, faces (m, 3) int64, and the symbols of their materials in runs.

    A geometry without a mesh, as curves are, has no vertex.  Raises :class:`UnreadableMeshError`.
    """
    points: list[FloatArray] = []
    starts: dict[int, int] = {}  # by source: many lists of vertices may be of the same numbers
    befores = [0]
    faces = [np.empty((0, 3), dtype=np.int64)]
    symbols: list[tuple[str, int]] = []
    count = 0
    mesh = geometry.find("mesh")
    # Ids are to be unique in the file, and some writers repeat them in every mesh.
    mine = {one.get("id", ""): one for one in geometry.iter()}
    for one in () if mesh is None else mesh:
        if one.tag not in _KINDS:
            continue
        reader = _Primitive(one, ChainMap(mine, ids), where)
        source = reader.source()
        if id(source) not in starts:
            starts[id(source)] = len(points)
            points.append(reader.positions_of(source))
            befores.append(befores[-1] + len(points[-1]))
        place = starts[id(source)]
        triangles = reader.triangles(points[place])
        faces.append(triangles + befores[place])
        symbols.append((one.get("material", ""), len(triangles)))
        count += len(triangles)
    return np.concatenate([np.empty((0, 3)), *points]), np.concatenate(faces), symbols


class _Primitive:
    """A list of triangles, polygons, strips or fans of a mesh."""

    def __init__(self, element: Element, ids: Ids, where: str) -> None:
        self._element, self._ids, self._where = element, ids, where
        inputs = element.findall("input")
        offsets = [self._whole(one.get("offset", "0"), "offset") for one in inputs]
        places = [k for k, one in enumerate(inputs) if one.get("semantic") == "VERTEX"]
        if not places:
            raise self._wrong("has no input of vertices")
        self._stride, self._offset = max(offsets) + 1, offsets[places[0]]
        self._vertices = inputs[places[0]].get("source", "")

    def source(self) -> Element:
        """Where the positions of all vertices are that the primitive may name."""
        vertices = self._found(self._vertices)
        for one in vertices.findall("input"):
            if one.get("semantic") == "POSITION":
                return self._found(one.get("source", ""))
        raise self._wrong("has vertices without positions")

    def positions_of(self, source: Element) -> FloatArray:
        """(n, 3)."""
        array, accessor = source.find("float_array"), source.find("technique_common/accessor")
        if array is None or accessor is None:
            raise self._wrong("has a source without numbers")
        values = read_floats(array, self._where)
        promised = self._whole(array.get("count", str(len(values))), "count")
        if len(values) != promised:
            raise self._wrong(f"was promised {promised} numbers, and {len(values)} are there")
        names = [one.get("name", "") for one in accessor.findall("param")]
        columns = [place for place, name in enumerate(names) if name][:3] or [0, 1, 2]
        stride = self._whole(accessor.get("stride", "1"), "stride")
        offset = self._whole(accessor.get("offset", "0"), "offset")
        if len(columns) < 3 or stride < columns[-1] + 1:
            raise self._wrong("has positions of fewer than three coordinates")
        rows = max(len(values) - offset, 0) // stride
        return np.ascontiguousarray(
            values[offset : offset + rows * stride].reshape(rows, stride)[:, columns]
        )

    def triangles(self, points: FloatArray) -> IndexArray:
        """(m, 3) int64; polygons are cut as in every format, whatever their shape."""
        if self._element.find("ph") is not None:
            raise self._wrong("has polygons with holes, which are not read")
        lists = [self._corners(one) for one in self._element.findall("p")]
        joined = np.concatenate([np.empty(0, dtype=np.int64), *lists])
        kind = self._element.tag
        if kind == "polygons":
            sizes = np.array([len(one) for one in lists], dtype=np.int64)
        elif kind == "polylist":
            sizes = self._sizes(len(joined))
        else:
            if kind == "tristrips":
                lists = [strip_triangles(one).reshape(-1) for one in lists]
            elif kind == "trifans":
                lists = [fan_triangles(one).reshape(-1) for one in lists]
            joined = np.concatenate([np.empty(0, dtype=np.int64), *lists])
            if len(joined) % 3:
                raise self._wrong(f"has {len(joined)} corners, which is not a number of triangles")
            sizes = np.full(len(joined) // 3, 3, dtype=np.int64)
        promised = self._whole(self._element.get("count", "0"), "count")
        if kind in ("triangles", "polylist") and len(sizes) < promised:
            raise self._wrong(f"was promised {promised} faces, and {len(sizes)} are there")
        return triangulate_polygons(points, sizes, joined, where=self._where)

    def _corners(self, element: Element) -> IndexArray:
        """The indices of vertices among those of all inputs."""
        numbers = read_integers(element, self._where)
        if len(numbers) % self._stride:
            raise self._wrong(f"has {len(numbers)} indices for {self._stride} inputs a corner")
        return numbers[self._offset :: self._stride]

    def _sizes(self, corners: int) -> IndexArray:
        element = self._element.find("vcount")
        sizes = np.empty(0, dtype=np.int64)
        if element is not None:
            sizes = read_integers(element, self._where)
        if (sizes < 0).any() or (sizes > corners).any() or int(sizes.sum()) != corners:
            raise self._wrong(f"has {corners} corners, and its vcount says otherwise")
        return sizes

    def _found(self, address: str) -> Element:
        found = self._ids.get(address.removeprefix("#"))
        if found is None:
            raise self._wrong(f"refers to '{address[:60]}', which is not in the file")
        return found

    def _whole(self, text: str, what: str) -> int:
        if not text.strip().isdecimal() or len(text) > 18:
            raise self._wrong(f"has '{text[:20]}' for its {what}")
        return int(text)

    def _wrong(self, what: str) -> UnreadableMeshError:
        return UnreadableMeshError(
            f"<{self._element.tag}> {what}", where=self._where, remedy=_EXPORT
        )
