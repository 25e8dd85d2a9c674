"""glTF 2.0, as .glb and .gltf: all meshes of the scene in world coordinates, float64.

What a file claims to hold is told by its accessors, once for each instance of a mesh.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simplifier.geometry.mesh import FloatArray, IndexArray
from simplifier.io.claim import Claim, Peek
from simplifier.io.gltf_buffers import (
    Buffers,
    claimed_bytes,
    external_uris,
    read_accessor,
    read_vectors,
)
from simplifier.io.gltf_container import (
    JsonObject,
    compressed,
    number_or_nan,
    open_document,
    peek_document,
    split_chunks,
)
from simplifier.io.gltf_scene import (
    Instances,
    claimed_instances,
    instances_of,
    list_instances,
    mesh_name,
    scene_nodes,
    subtree,
)
from simplifier.io.labels import Label, Labelled
from simplifier.io.objects import Objects
from simplifier.io.placing import MOST_TRIANGLES, place_instances
from simplifier.io.polygons import fan_triangles, strip_triangles

GENERATOR = "planar-occluder"
_URI = b'"uri"'
_LETTER_OF_URI = re.compile(rb"\\u00(75|72|69)")
"""Only JSON with this member names files: its name as it is, or one of its letters as a code.  To
look for both takes a twentieth of the time that it takes to read the JSON."""

BEFORE = "before"
"""In the extras of an occluder that stands behind its original: what there was without it."""


def decode(data: bytes, path: Path) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) int64, instance by instance in node order.

    Transforms are composed and applied in float64: a building at 5,176,000 m keeps its millimetres,
    which float32 would round to half a metre.  Under a mirroring transform the winding is turned,
    as the format asks for.  Quantized, normalized, sparse and interleaved accessors and
    EXT_mesh_gpu_instancing are understood.  Of an original with its occluder only the occluder is
    given.  Raises :class:`UnreadableMeshError`.
    """
    buffers = Buffers(open_document(data, str(path)), path)
    root = buffers.document.root
    embedded = _embedded_node(root)
    if embedded is None:
        return read_instances(buffers, list_instances(buffers), str(path))
    nodes = subtree(root, embedded)
    return read_instances(buffers, instances_of(buffers, nodes, nodes.world()), str(path))


def _embedded_node(root: JsonObject) -> int | None:
    """The node that ``glb_embed`` put behind those of an original."""
    last = root.count("nodes") - 1
    if last < 0:
        return None
    extras = root.item("nodes", last).members.get("extras")
    known = isinstance(extras, dict) and extras.get("generator") == GENERATOR and BEFORE in extras
    return last if known else None


def decode_labelled(data: bytes, path: Path, allow_external: bool) -> Labelled:
    """As :func:`decode`, with the names of nodes, meshes and materials."""
    buffers = Buffers(open_document(data, str(path)), path)
    instances = list_instances(buffers)
    meshes: dict[int, tuple[FloatArray, IndexArray]] = {}
    kinds: dict[int, list[tuple[str, bool, int]]] = {}
    for mesh in _meshes_in_use(instances):
        primitives = read_gltf_mesh(buffers, mesh)
        meshes[mesh] = join_primitives(primitives)
        kinds[mesh] = [(one.material, one.see_through, len(one.faces)) for one in primitives]
        del primitives  # not to be held beside the joined mesh
    vertices, faces = place_instances(
        meshes, instances.mesh_of.tolist(), instances.transforms, str(path)
    )
    names = {mesh: mesh_name(buffers.document.root, mesh) for mesh in meshes}
    labels, counts = [], []
    for owner, mesh, is_occluder in zip(
        instances.owners, instances.mesh_of.tolist(), instances.occluders().tolist(), strict=True
    ):
        objects = tuple(dict.fromkeys(name for name in (owner, names[mesh]) if name))
        for material, see_through, count in kinds[mesh]:
            labels.append(Label(objects, material, see_through, is_occluder))
            counts.append(count)
    return Labelled(vertices, faces, labels, counts)


def read_instances(
    buffers: Buffers, instances: Instances, where: str
) -> tuple[FloatArray, IndexArray]:
    """Vertices (n, 3) float64 and faces (m, 3) int64 of instances, in world coordinates."""
    meshes = {
        mesh: join_primitives(read_gltf_mesh(buffers, mesh)) for mesh in _meshes_in_use(instances)
    }
    return place_instances(meshes, instances.mesh_of.tolist(), instances.transforms, where)


def _meshes_in_use(instances: Instances) -> list[int]:
    """The meshes that have a place."""
    return sorted(set(instances.mesh_of.tolist()))


def objects(data: bytes, path: Path, see_through: bool) -> Objects:
    """The nodes and instances with a mesh, each mesh once and in its own space.

    ``see_through``  whether what can be seen through is taken, too; else it is counted.

    A value of a transform that is no finite number becomes NaN; nothing else is forgiven that
    :func:`decode` refuses, but there is no limit on what the instances add up to.
    """
    buffers = Buffers(open_document(data, str(path)), path)
    instances = list_instances(buffers, lenient=True)
    used, mesh_of = np.unique(instances.mesh_of, return_inverse=True)
    found = [read_gltf_mesh(buffers, mesh) for mesh in used.tolist()]
    left_out = [[one for one in parts if one.see_through and not see_through] for parts in found]
    meshes = [
        join_primitives([one for one in parts if see_through or not one.see_through])
        for parts in found
    ]
    counts = [sum(len(one.faces) for one in parts) for parts in left_out]
    places = mesh_of.reshape(-1)
    return Objects(
        instances.names, meshes, places, instances.transforms, counts, instances.occluders()
    )


def external(data: bytes, path: Path) -> list[str]:
    """The files that :func:`decode` and :func:`objects` may open beside this one."""
    text, _ = split_chunks(data, str(path))
    if _URI not in text and not _LETTER_OF_URI.search(text):
        return []
    # Whoever reads what is told here looks for names that occur twice.
    return external_uris(open_document(data, str(path), names_once=False).root)


def error_bound(data: bytes, path: Path) -> float:
    """The bound that ``glb_writer.encode`` left in a node's extras; infinite without one.

    The largest one when several occluders were joined into one file, the finest level's of levels
    of detail.
    """
    root = open_document(data, str(path)).root
    bounds = []
    embedded = _embedded_node(root)
    nodes = scene_nodes(root).nodes if embedded is None else [root.item("nodes", embedded)]
    for node in nodes:
        extras = node.members.get("extras")
        if isinstance(extras, dict) and extras.get("generator") == GENERATOR:
            bound = number_or_nan(extras.get("error_bound"))
            bounds.append(bound if bound >= 0.0 else math.inf)
    return max(bounds, default=math.inf)


_STRIP = 5  # the first mode with about a triangle a corner
_MOST_ZEROS = 1_000_000  # elements that a file may claim without any data


def claim(peek: Peek) -> Claim:
    """The JSON is read, the buffers are not."""
    root = peek_document(peek).root
    data = claimed_bytes(root, peek)
    most = data + _MOST_ZEROS
    instances = claimed_instances(root)
    sizes = {mesh: _size(root.item("meshes", mesh), root, most) for mesh in instances}
    vertices = sum(count * sizes[mesh][0] for mesh, count in instances.items())
    triangles = sum(count * sizes[mesh][1] for mesh, count in instances.items())
    own = sum(24 * sum(size) for size in sizes.values())
    if max(vertices, triangles) > MOST_TRIANGLES:  # reading refuses it before all are in one
        return Claim(0, 0, peek.size + data + own)
    # The file and its buffers, meshes as they stand in it, their instances, and all in one.
    decoding = peek.size + data + own + 2 * 24 * (vertices + triangles)
    return Claim(vertices, triangles, decoding)


def _size(mesh: JsonObject, root: JsonObject, most: int) -> tuple[int, int]:
    """Vertices and triangles; no accessor has more than ``most`` elements."""
    vertices = triangles = 0
    for place in range(mesh.count("primitives")):
        primitive = mesh.item("primitives", place)
        attributes = primitive.child("attributes")
        if not attributes.has("POSITION"):
            continue
        corners = count = _count(root, attributes.integer("POSITION"), most)
        if primitive.has("indices"):
            corners = _count(root, primitive.integer("indices"), most)
        vertices += count
        triangles += corners if primitive.integer("mode", 4) >= _STRIP else corners // 3
    return vertices, triangles


def _count(root: JsonObject, accessor: int, most: int) -> int:
    return min(root.item("accessors", accessor).integer("count"), most)


_POINTS_AND_LINES = (0, 1, 2, 3)
_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class Primitive:
    """Vertices (n, 3) float64 and faces (m, 3) of one, with the name of its material.

    ``see_through``  as of :func:`~simplifier.io.gltf.material_of`.
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
    if primitive.has_extension(draco):
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
