"""The meshes of a glTF file as triangles.

What a glTF file says of the material of a primitive, as far as it matters here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.io.gltf_buffers import Buffers, read_accessor, read_vectors
from simplifier.io.gltf_container import JsonObject, compressed, number_or_nan
from simplifier.io.polygons import fan_triangles, strip_triangles

_POINTS_AND_LINES = (0, 1, 2, 3)
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class Primitive:
    """Vertices (n, 3) float64 and faces (m, 3) of one, with the name of its material.

    ``see_through``  as of :func:`~simplifier.io.gltf_primitives.material_of`.
    """

    vertices: FloatArray
    faces: IndexArray
    material: str
    see_through: bool


def read_gltf_mesh(buffers: Buffers, index: int) -> list[Primitive]:
    """A mesh's primitives that have triangles, in its own space.

    Points and lines are skipped, as are primitives without positions.  Morph targets and skins are
    not applied: the mesh is taken in its base shape.
    """
    root = buffers.document.root
    mesh = root.item("meshes", index)
    found = []
    for place in range(mesh.count("primitives")):
        primitive = mesh.item("primitives", place)
        if not primitive.child("attributes").has("POSITION"):
            continue
        mode = primitive.integer("mode", _TRIANGLES)
        if mode in _POINTS_AND_LINES:
            continue
        points = _read_points(buffers, primitive)
        faces = _read_triangles(buffers, primitive, mode, len(points))
        found.append(Primitive(points, faces, *material_of(root, primitive)))
    return found


def join_primitives(primitives: Sequence[Primitive]) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) of all, in order; none may be given."""
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    count = 0
    for one in primitives:
        vertices.append(one.vertices)
        faces.append(one.faces + count)
        count += len(one.vertices)
    return np.concatenate(vertices), np.concatenate(faces)


def _read_points(buffers: Buffers, primitive: JsonObject) -> FloatArray:
    index = primitive.child("attributes").integer("POSITION")
    draco = "KHR_draco_mesh_compression"
    # With a fallback, the accessors hold the same geometry uncompressed.
    if primitive.child("extensions").has(draco):
        accessor = buffers.document.root.item("accessors", index)
        if not accessor.has("bufferView"):
            raise compressed(primitive, draco)
    return read_vectors(buffers, index, "VEC3")


def _read_triangles(buffers: Buffers, primitive: JsonObject, mode: int, count: int) -> IndexArray:
    if primitive.has("indices"):
        stored = read_accessor(buffers, primitive.integer("indices"), "SCALAR")
        if stored.dtype.kind != "u":
            raise primitive.fail("its indices are not unsigned whole numbers")
        indices = stored[:, 0].astype(np.int64)
    else:
        indices = np.arange(count)
    if len(indices) and int(indices.max()) >= count:
        raise primitive.fail(
            f"names vertex {int(indices.max())}, but there are {count}",
            "the file is damaged; export it again",
        )
    if mode == _TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    if mode == _STRIP:
        return strip_triangles(indices)
    if mode == _FAN:
        return fan_triangles(indices)
    raise primitive.fail(f"mode {mode} is unknown", "the file is damaged; export it again")


_BLENDED = ("BLEND", "MASK")
_TRANSMISSION = "KHR_materials_transmission"


def material_of(root: JsonObject, primitive: JsonObject) -> tuple[str, bool]:
    """Its name, "material 3" where it has none, and whether one sees through it.

    Without a material the name is empty.  One sees through an ``alphaMode`` of BLEND or MASK,
    whatever the colours are, and through a transmission above 0 (KHR_materials_transmission).
    KHR_materials_volume says nothing of it, for it only has an effect with the former; diffuse
    transmission lets light through but no picture.

    Nothing here is worth refusing a mesh for: what is damaged is no material.
    """
    place, materials = primitive.members.get("material"), root.members.get("materials")
    if not isinstance(place, int) or not isinstance(materials, list):
        return "", False
    if not 0 <= place < len(materials) or not isinstance(materials[place], dict):
        return "", False
    material = materials[place]
    name = material.get("name")
    see_through = material.get("alphaMode") in _BLENDED or _transmission(material) > 0.0
    return name if isinstance(name, str) and name else f"material {place}", see_through


def _transmission(material: dict[str, object]) -> float:
    extensions = material.get("extensions")
    found = extensions.get(_TRANSMISSION) if isinstance(extensions, dict) else None
    return number_or_nan(found.get("transmissionFactor")) if isinstance(found, dict) else 0.0
