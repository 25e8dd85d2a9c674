"""The node tree of a glTF file: which mesh stands where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray
from simplifier.io.gltf_accessor import read_vectors
from simplifier.io.gltf_buffers import Buffers
from simplifier.io.gltf_json import JsonObject
from simplifier.io.gltf_levels import level_ids

_INSTANCING = "EXT_mesh_gpu_instancing"


@dataclass(frozen=True, eq=False)
class Instance:
    """``transform`` (4, 4) float64 takes the mesh's space to the world (column vectors)."""

    mesh: int
    transform: FloatArray


@dataclass(frozen=True, eq=False)
class PlacedNode:
    """A node; ``parent`` and ``transform`` (4, 4) take its parent's and its own space outwards."""

    index: int
    node: JsonObject
    parent: FloatArray
    transform: FloatArray


def list_instances(buffers: Buffers) -> list[Instance]:
    """Every mesh of the default scene, depth first in the order of the file.

    Without a default scene all nodes count, and without nodes every mesh once.  Of levels of detail
    only the finest counts.  Raises ``UnreadableMeshError`` when a node is reached twice, which a
    tree forbids and a cycle implies.
    """
    root = buffers.document.root
    if root.count("nodes") == 0:
        return [Instance(mesh, np.eye(4)) for mesh in range(root.count("meshes"))]
    return instances_of(buffers, scene_nodes(root))


def instances_of(buffers: Buffers, nodes: list[PlacedNode]) -> list[Instance]:
    """The meshes of some nodes."""
    return [
        Instance(placed.node.integer("mesh"), _compose(placed.transform, local))
        for placed in nodes
        if placed.node.has("mesh")
        for local in _instance_transforms(buffers, placed.node)
    ]


def scene_nodes(root: JsonObject) -> list[PlacedNode]:
    """The nodes of :func:`list_instances`, with or without a mesh."""
    coarser = {index for ids in level_ids(root).values() for index in ids}
    reached, shown = _walk(root, [(index, np.eye(4)) for index in _root_nodes(root)], coarser)
    if not root.has("scene") and reached < root.count("nodes"):
        raise root.fail("its nodes form a cycle", "repair the node tree and export it again")
    return shown


def subtree(root: JsonObject, index: int, parent: FloatArray) -> list[PlacedNode]:
    """A node and those below it; ``parent`` (4, 4) as of :class:`PlacedNode`."""
    return _walk(root, [(index, parent)], set())[1]


def _walk(
    root: JsonObject, begin: list[tuple[int, FloatArray]], hidden: set[int]
) -> tuple[int, list[PlacedNode]]:
    """How many nodes are reached, and those that are neither hidden nor below one that is."""
    shown: list[PlacedNode] = []
    reached: set[int] = set()
    stack = [(index, parent, True) for index, parent in reversed(begin)]
    while stack:
        index, parent, visible = stack.pop()
        node = root.item("nodes", index)
        if index in reached:
            raise node.fail(
                "is reached twice: the nodes form a cycle or share a child",
                "repair the node tree and export it again",
            )
        reached.add(index)
        visible = visible and index not in hidden
        world = _compose(parent, _local_transform(node))
        if visible:
            shown.append(PlacedNode(index, node, parent, world))
        stack += [(child, world, visible) for child in reversed(node.integers("children"))]
    return len(reached), shown


def _root_nodes(root: JsonObject) -> list[int]:
    """The default scene's nodes, or all that are nobody's child."""
    if root.has("scene"):
        return root.item("scenes", root.integer("scene")).integers("nodes")
    count = root.count("nodes")
    children = {child for i in range(count) for child in root.item("nodes", i).integers("children")}
    return [index for index in range(count) if index not in children]


def _compose(outer: FloatArray, inner: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(outer @ inner)


def _local_transform(node: JsonObject) -> FloatArray:
    if not any(node.has(key) for key in ("matrix", "translation", "rotation", "scale")):
        return np.eye(4)
    matrix = node.numbers("matrix", 16)
    if matrix is not None:
        return np.array(matrix).reshape(4, 4).T  # stored by columns
    translation = node.numbers("translation", 3)
    rotation = node.numbers("rotation", 4)
    scale = node.numbers("scale", 3)
    return _transform(
        np.array(translation or (0.0, 0.0, 0.0)),
        np.array(rotation or (0.0, 0.0, 0.0, 1.0)),
        np.array(scale or (1.0, 1.0, 1.0)),
    )


def _transform(translation: FloatArray, rotation: FloatArray, scale: FloatArray) -> FloatArray:
    """Scale, then rotate by the quaternion x y z w (normalized here), then translate."""
    length = float(np.linalg.norm(rotation))
    x, y, z, w = rotation / length if 0.0 < length < np.inf else (0.0, 0.0, 0.0, 1.0)
    result = np.eye(4)
    result[:3, :3] = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
        [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
        [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    with np.errstate(invalid="ignore", over="ignore"):
        result[:3, :3] *= scale
    result[:3, 3] = translation
    return result


def _instance_transforms(buffers: Buffers, node: JsonObject) -> list[FloatArray]:
    """One identity, or a transform for each instance of EXT_mesh_gpu_instancing."""
    attributes = node.child("extensions").child(_INSTANCING).child("attributes")
    stored = {
        name: read_vectors(buffers, attributes.integer(name), kind)
        for name, kind in (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
        if attributes.has(name)
    }
    if not stored:
        return [np.eye(4)]
    counts = {len(values) for values in stored.values()}
    if len(counts) > 1:
        raise node.fail(f"the attributes of {_INSTANCING} differ in length", "export it again")
    (count,) = counts
    translations = stored.get("TRANSLATION", np.zeros((count, 3)))
    rotations = stored.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))
    scales = stored.get("SCALE", np.ones((count, 3)))
    return [_transform(*one) for one in zip(translations, rotations, scales, strict=True)]
