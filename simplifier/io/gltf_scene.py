"""The node tree of a glTF file: which mesh stands where.

Transforms of glTF nodes, all of a file at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray
from simplifier.io.gltf_buffers import Buffers, read_vectors
from simplifier.io.gltf_container import JsonObject
from simplifier.io.gltf_levels import level_ids

_INSTANCING = "EXT_mesh_gpu_instancing"
_ATTRIBUTES = (("TRANSLATION", "VEC3"), ("ROTATION", "VEC4"), ("SCALE", "VEC3"))
# A few lines of JSON can claim millions of instances by accessors without data.
MOST_INSTANCES = 10_000_000


@dataclass(frozen=True, eq=False)
class Instances:
    """Meshes of a glTF file, each at its place.

    ``names``       of the node, else of the mesh, else "node 12"; not unique, but the instances of
                    one node are numbered: "tree", "tree.2", "tree.3".
    ``owners``      name of the node alone, of the mesh where there are no nodes; may be empty.
    ``mesh_of``     (n,) int64, places in the file's meshes.
    ``transforms``  (n, 4, 4) float64, from the mesh's space to the world (column vectors).
    """

    names: list[str]
    owners: list[str]
    mesh_of: NDArray[np.int64]
    transforms: FloatArray

    def occluders(self) -> NDArray[np.bool_]:
        """(n,) those that a viewer is not to see: the meshes of nodes "...-occonly", which Godot
        makes occluders of; none where there are no others."""
        found = np.array([owner.endswith("-occonly") for owner in self.owners], dtype=np.bool_)
        return found & (not found.all())


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of a glTF file, depth first.

    ``nodes``, ``indices``  what the file says of each, and its number there.
    ``parents``  places in ``nodes``, or -1.
    """

    nodes: list[JsonObject]
    indices: list[int]
    parents: list[int]

    def world(self, *, lenient: bool = False) -> FloatArray:
        """(n, 4, 4) float64 from each node's space to that of nodes without a parent here."""
        return world_transforms(local_transforms(self.nodes, lenient=lenient), self.parents)


def list_instances(buffers: Buffers, *, lenient: bool = False) -> Instances:
    """Every mesh of the default scene, depth first in the order of the file.

    Without a default scene all nodes count, and without nodes every mesh once.  Of levels of detail
    only the finest counts.  Raises ``UnreadableMeshError`` when a node is reached twice, which a
    tree forbids and a cycle implies, for more than ``MOST_INSTANCES``, and, unless ``lenient``, for
    values of a transform that are no finite numbers; if so, they become NaN.
    """
    root = buffers.document.root
    if root.count("nodes") == 0:
        return _every_mesh(root)
    nodes = scene_nodes(root)
    return instances_of(buffers, nodes, nodes.world(lenient=lenient))


def claimed_instances(root: JsonObject) -> dict[int, int]:
    """How often each mesh of :func:`list_instances` stands there, as the JSON alone says."""
    if root.count("nodes") == 0:
        return dict.fromkeys(range(root.count("meshes")), 1)
    counts: dict[int, int] = {}
    for node in scene_nodes(root).nodes:
        if node.has("mesh"):
            mesh = node.integer("mesh")
            counts[mesh] = counts.get(mesh, 0) + _count_claimed(node, root)
    return counts


def instances_of(buffers: Buffers, nodes: Nodes, world: FloatArray) -> Instances:
    """The meshes of some nodes; ``world`` (n, 4, 4) as of :meth:`Nodes.world`."""
    root = buffers.document.root
    names: list[str] = []
    owners: list[str] = []
    meshes: list[int] = []
    places: list[int] = []
    within: list[tuple[int, FloatArray]] = []  # from where on instances stand otherwise than nodes
    for place in _standing(nodes, root):
        node = nodes.nodes[place]
        count, mesh = 1, node.integer("mesh")
        if node.has_extension(_INSTANCING):
            own = _instance_transforms(buffers, node)
            count = len(own)
            within.append((len(names), own))
        owner = _name(node)
        name = owner or mesh_name(root, mesh) or f"node {nodes.indices[place]}"
        names += [name if number == 0 else f"{name}.{number + 1}" for number in range(count)]
        owners += [owner] * count
        meshes += [mesh] * count
        places += [place] * count
    transforms = world[places]
    with np.errstate(invalid="ignore", over="ignore"):
        for begin, own in within:
            transforms[begin : begin + len(own)] @= own
    return Instances(names, owners, np.array(meshes, dtype=np.int64), transforms)


def scene_nodes(root: JsonObject) -> Nodes:
    """The nodes of :func:`list_instances`, with or without a mesh."""
    coarser = {index for ids in level_ids(root).values() for index in ids}
    reached, shown = _walk(root, _root_nodes(root), coarser)
    if not root.has("scene") and reached < root.count("nodes"):
        raise root.fail("its nodes form a cycle", "repair the node tree and export it again")
    return shown


def subtree(root: JsonObject, index: int) -> Nodes:
    """A node, which has no parent here, and those below it."""
    return _walk(root, [index], set())[1]


def _every_mesh(root: JsonObject) -> Instances:
    count = root.count("meshes")
    owners = [mesh_name(root, mesh) for mesh in range(count)]
    names = [owner or f"mesh {mesh}" for mesh, owner in enumerate(owners)]
    return Instances(names, owners, np.arange(count), np.tile(np.eye(4), (count, 1, 1)))


def _walk(root: JsonObject, begin: list[int], hidden: set[int]) -> tuple[int, Nodes]:
    """How many nodes are reached, and those that are neither hidden nor below one that is."""
    shown = Nodes([], [], [])
    nodes = list(root.items("nodes"))
    reached: set[int] = set()
    stack = [(index, -1, True) for index in reversed(begin)]
    while stack:
        index, parent, visible = stack.pop()
        node = nodes[index] if index < len(nodes) else root.item("nodes", index)  # which refuses it
        if index in reached:
            raise node.fail(
                "is reached twice: the nodes form a cycle or share a child",
                "repair the node tree and export it again",
            )
        reached.add(index)
        visible = visible and index not in hidden
        if "children" in node.members:  # of few: what else is asked would be half of the walk
            place = len(shown.nodes)
            stack += [(child, place, visible) for child in reversed(node.integers("children"))]
        if visible:
            shown.nodes.append(node)
            shown.indices.append(index)
            shown.parents.append(parent)
    return len(reached), shown


def _root_nodes(root: JsonObject) -> list[int]:
    """The default scene's nodes, or all that are nobody's child."""
    if root.has("scene"):
        return root.item("scenes", root.integer("scene")).integers("nodes")
    children = {child for node in root.items("nodes") for child in node.integers("children")}
    return [index for index in range(root.count("nodes")) if index not in children]


def mesh_name(root: JsonObject, mesh: int) -> str:
    """Empty without one."""
    return _name(root.item("meshes", mesh))


def _name(owner: JsonObject) -> str:
    name = owner.members.get("name")
    return name if isinstance(name, str) else ""


def _standing(nodes: Nodes, root: JsonObject) -> list[int]:
    """Places of the nodes with a mesh.

    Their instances, which are only claimed so far, are counted before any transform is made.
    """
    places = [place for place, node in enumerate(nodes.nodes) if node.has("mesh")]
    count = sum(_count_claimed(nodes.nodes[place], root) for place in places)
    if count > MOST_INSTANCES:
        raise root.fail(f"it has {count} objects, more than {MOST_INSTANCES}", "split the scene")
    return places


def _count_claimed(node: JsonObject, root: JsonObject) -> int:
    """Instances of a node's mesh, as the file says."""
    if not node.has_extension(_INSTANCING):
        return 1
    attributes = _instancing(node)
    claims = [
        root.item("accessors", attributes.integer(name)).integer("count")
        for name, _ in _ATTRIBUTES
        if attributes.has(name)
    ]
    return max(claims, default=1)


def _instancing(node: JsonObject) -> JsonObject:
    return node.child("extensions").child(_INSTANCING).child("attributes")


def _instance_transforms(buffers: Buffers, node: JsonObject) -> FloatArray:
    """(k, 4, 4): one identity, or a transform for each instance of EXT_mesh_gpu_instancing."""
    attributes = _instancing(node)
    stored = {
        name: read_vectors(buffers, attributes.integer(name), kind)
        for name, kind in _ATTRIBUTES
        if attributes.has(name)
    }
    if not stored:
        return np.eye(4)[None]
    counts = {len(values) for values in stored.values()}
    if len(counts) > 1:
        raise node.fail(f"the attributes of {_INSTANCING} differ in length", "export it again")
    (count,) = counts
    return transforms_of(
        stored.get("TRANSLATION", np.zeros((count, 3))),
        stored.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))),
        stored.get("SCALE", np.ones((count, 3))),
    )


_PROJECTION = 1e-6  # what rounding may leave in the last row of a matrix


def local_transforms(nodes: Sequence[JsonObject], *, lenient: bool) -> FloatArray:
    """(n, 4, 4) float64 of nodes by matrix, by translation, rotation and scale, or by neither.

    Raises ``UnreadableMeshError`` for arrays of a wrong length, and unless ``lenient`` for matrices
    that are not affine and for values that are no finite numbers, which become NaN otherwise.
    """
    matrices: dict[int, list[float]] = {}
    parts: dict[int, list[float]] = {}
    for place, node in enumerate(nodes):
        matrix = _numbers(node, "matrix", 16, lenient)
        if matrix is not None:
            if not lenient and not _is_affine(matrix):
                raise node.fail(
                    f"the last row of its matrix is {matrix[3::4]}, not 0 0 0 1",
                    "take the projection out of the node",
                )
            matrices[place] = matrix
        elif any(node.has(key) for key in ("translation", "rotation", "scale")):
            parts[place] = [
                *(_numbers(node, "translation", 3, lenient) or (0.0, 0.0, 0.0)),
                *(_numbers(node, "rotation", 4, lenient) or (0.0, 0.0, 0.0, 1.0)),
                *(_numbers(node, "scale", 3, lenient) or (1.0, 1.0, 1.0)),
            ]
    result = np.tile(np.eye(4), (len(nodes), 1, 1))
    if matrices:
        by_columns = np.array(list(matrices.values())).reshape(-1, 4, 4)
        result[list(matrices)] = by_columns.transpose(0, 2, 1)
    if parts:
        values = np.array(list(parts.values()))
        result[list(parts)] = transforms_of(values[:, :3], values[:, 3:7], values[:, 7:])
    return result


def _is_affine(matrix: Sequence[float]) -> bool:
    rest = (matrix[3], matrix[7], matrix[11], matrix[15] - 1.0)
    return max(map(abs, rest)) <= _PROJECTION


def _numbers(node: JsonObject, key: str, length: int, lenient: bool) -> list[float] | None:
    return node.numbers_or_nan(key, length) if lenient else node.numbers(key, length)


def transforms_of(
    translations: FloatArray, rotations: FloatArray, scales: FloatArray
) -> FloatArray:
    """(n, 4, 4): scale (n, 3), then rotate by quaternions x y z w (n, 4), then translate (n, 3).

    Quaternions are normalized here, and one of length 0 does not rotate.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = np.linalg.norm(rotations, axis=1, keepdims=True)
        x, y, z, w = (rotations / np.where(lengths == 0.0, 1.0, lengths)).T
        rows = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
        result = np.zeros((len(translations), 4, 4))
        result[:, :3, :3] = np.array(rows).transpose(2, 0, 1) * scales[:, None, :]
    result[:, :3, 3] = translations
    result[:, 3, 3] = 1.0
    return result


def world_transforms(local: FloatArray, parents: Sequence[int]) -> FloatArray:
    """(n, 4, 4): each after that of its parent, an earlier place, or -1 for none."""
    depth = np.zeros(len(local), dtype=np.int64)
    for place, parent in enumerate(parents):
        if parent >= 0:
            depth[place] = depth[parent] + 1
    by_depth = np.argsort(depth, kind="stable")
    levels = np.split(by_depth, np.cumsum(np.bincount(depth))[:-1]) if len(local) else []
    world, above = local.copy(), np.asarray(parents, dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        for places in levels[1:]:
            world[places] = world[above[places]] @ local[places]
    return world
