"""What a glTF file claims to hold: by its accessors, once for each instance of a mesh."""

from __future__ import annotations

from simplifier.io.claim import Claim, Peek
from simplifier.io.gltf import MOST_TRIANGLES
from simplifier.io.gltf_buffers import claimed_bytes
from simplifier.io.gltf_container import peek_document
from simplifier.io.gltf_json import JsonObject
from simplifier.io.gltf_scene import claimed_instances

_STRIP = 5  # the first mode with about a triangle a corner
_MOST_ZEROS = 1_000_000  # elements that a file may claim without any data


def claim(peek: Peek) -> Claim:
    """The JSON is read, the buffers are not."""
    root = peek_document(peek).root
    data = claimed_bytes(root, peek)
    most = data + _MOST_ZEROS
    sizes = {
        mesh: _size(root.item("meshes", mesh), root, most) for mesh in range(root.count("meshes"))
    }
    instances = claimed_instances(root)
    vertices = sum(count * sizes[mesh][0] for mesh, count in instances.items())
    triangles = sum(count * sizes[mesh][1] for mesh, count in instances.items())
    own = sum(24 * sum(sizes[mesh]) for mesh in instances)
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
