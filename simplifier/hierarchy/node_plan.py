"""Tree of parts -> Job[]: which nodes get an occluder, from what, and under which key.

Keys: the hash of all that an occluder is made from.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.camera import Lens
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.scene import scales
from simplifier.hierarchy.node import COARSENESS, NodeKind, Stand
from simplifier.hierarchy.parts import Parts
from simplifier.hierarchy.tree import Tree
from simplifier.options.scene import SceneOptions
from simplifier.options.simplify import Axis
from simplifier.version import VERSION

_FEWEST_PARTS = 4  # below an inner node: with fewer, the leaves do as well for as many triangles
_LEVEL = 1e-6  # an axis counts as upright where the cosine to up is this near to 1


@dataclass(frozen=True, eq=False)
class NodeJob:
    """One occluder to make.

    ``parts``  below the node, in the order in which they are joined; for the occluder of a leaf any
               one of those that share it.
    """

    key: str
    kind: NodeKind
    parts: IntArray
    stand: Stand


@dataclass(frozen=True)
class Keys:
    """Of a node's occluders; None for none.

    ``far``   with an error, to be drawn from where that is small: of inner nodes the only one.
    ``near``  narrow, to be drawn from anywhere, for leaves alone.
    """

    far: str | None = None
    near: str | None = None


@dataclass(frozen=True, eq=False)
class Plan:
    """``jobs`` by key; ``keys`` (k,) of the nodes."""

    jobs: dict[str, NodeJob]
    keys: tuple[Keys, ...]


def plan_occluders(parts: Parts, tree: Tree, options: SceneOptions) -> Plan:
    """The keys of every node, and what is to be made.

    Leaves of the same mesh share their occluders.  A leaf of few triangles has but a near one.  An
    inner node gets one when it has enough below it, and when a viewer in the scene can be so far
    away that its error stays below the pixel error.
    """
    scene = parts.scene
    whole = np.bincount(parts.object_of)[parts.object_of] == 1
    of_options = options_key(options)
    of_meshes = [mesh_key(mesh) for mesh in scene.meshes]
    stands = _stands(parts, whole, options)
    placed = keys_at_places([of_meshes[mesh] for mesh in scene.mesh_of], scene.transforms)
    # As one value a row, which compares byte by byte.
    ranks = np.unique(placed.view(f"V{placed.shape[1]}")[:, 0], return_inverse=True)[1]
    jobs: dict[str, NodeJob] = {}

    def alone(part: int, kind: NodeKind) -> str:
        mesh = scene.mesh_of[part]
        key = leaf_key(of_meshes[mesh], kind, stands[mesh], of_options)
        jobs.setdefault(key, NodeJob(key, kind, np.array([part], dtype=np.int32), stands[mesh]))
        return key

    def leaf(part: int) -> Keys:
        simple = len(scene.meshes[scene.mesh_of[part]].faces) <= options.budget
        exact_only = simple or options.conservative
        return Keys(None if exact_only else alone(part, "far"), alone(part, "near"))

    def inner(below: IntArray) -> str:
        below = below[np.argsort(ranks[below], kind="stable")]
        grounded = options.ground and bool(whole[below].all())
        stand = Stand(options.up if grounded else None, options.smallest_hole)
        key = node_key(placed[below], stand, of_options)
        jobs.setdefault(key, NodeJob(key, "inner", below, stand))
        return key

    keys = [Keys()] * len(tree)
    for node in np.nonzero(_useful(tree, options) & ~tree.is_leaf)[0].tolist():
        keys[node] = Keys(inner(tree.below(node)))
    of_leaves: dict[int, Keys] = {}  # by mesh, which may have a hundred thousand instances
    leaves = np.nonzero(tree.is_leaf)[0]
    parts_of = tree.order[tree.spans[leaves, 0]]
    meshes_of = scene.mesh_of[parts_of]
    for node, part, mesh in zip(
        leaves.tolist(), parts_of.tolist(), meshes_of.tolist(), strict=True
    ):
        if mesh not in of_leaves:
            of_leaves[mesh] = leaf(part)
        keys[node] = of_leaves[mesh]
    return Plan(jobs, tuple(keys))


def _useful(tree: Tree, options: SceneOptions) -> NDArray[np.bool_]:
    """(k,) inner nodes that are ever drawn from within the root's box."""
    extents = tree.bounds[:, 1] - tree.bounds[:, 0]
    error = COARSENESS * extents.max(axis=1) / options.resolution
    # So far off is never within the scene, whether the error is past all floats or there is none.
    with np.errstate(over="ignore", invalid="ignore"):
        seen_from = Lens(options.rows, options.fov).distance(1.0, options.pixel_error) * error
    enough = np.diff(tree.spans, axis=1)[:, 0] >= _FEWEST_PARTS
    return np.asarray(enough & (seen_from <= np.linalg.norm(extents[0])))


def _stands(parts: Parts, whole: NDArray[np.bool_], options: SceneOptions) -> list[Stand]:
    """How each mesh stands in its own space: what is so for all its instances."""
    scene = parts.scene
    stretch = np.zeros(len(scene.meshes))
    np.maximum.at(stretch, scene.mesh_of, scales(scene.transforms))
    with np.errstate(over="ignore"):
        holes = options.smallest_hole / np.where(stretch > 0.0, stretch, 1.0)
    axes = _upright_axes(parts, whole, options.up) if options.ground else [None] * len(holes)
    return [
        # Turning an instance must not change the key by rounding.
        Stand(axis, float(f"{hole:.6g}"))
        for axis, hole in zip(axes, holes.tolist(), strict=True)
    ]


def _upright_axes(parts: Parts, whole: NDArray[np.bool_], up: Axis) -> list[Axis | None]:
    """Of each mesh; None where an instance is but a piece of an object, or stands otherwise."""
    scene = parts.scene
    found = np.ones((len(scene.meshes), 3), dtype=np.bool_)
    so = _are_upright(scene.transforms, "xyz".index(up)) & whole[:, None]
    np.logical_and.at(found, scene.mesh_of, so)
    names: tuple[Axis, ...] = get_args(Axis)
    return [names[int(np.argmax(row))] if row.any() else None for row in found]


def _are_upright(transforms: FloatArray, up: int) -> NDArray[np.bool_]:
    """(n, 3) whether height grows along an axis of the mesh, and along no other, by each transform.

    So level planes of the world are planes across it, sheared or not.
    """
    heights = transforms[:, up, :3]
    heights = heights / np.abs(heights).max(axis=1, keepdims=True)  # squares must not vanish
    shares = heights / np.linalg.norm(heights, axis=1, keepdims=True)
    return np.asarray(shares > 1.0 - _LEVEL)


_FORMAT = b"24"  # raised when the same input is to give another occluder
_DIGITS = 32
_KEY = re.compile(f"[0-9a-f]{{{_DIGITS}}}")


def mesh_key(mesh: TriangleMesh) -> bytes:
    """Of the geometry alone."""
    made = hashlib.sha256(len(mesh.vertices).to_bytes(8, "little"))
    made.update(np.ascontiguousarray(mesh.vertices).data)
    made.update(np.ascontiguousarray(mesh.faces).data)
    return made.digest()


def options_key(options: SceneOptions) -> bytes:
    """Of what all occluders depend on: neither the tree's width nor where they will be seen from.

    Up, ground and hole are not among it: a :class:`Stand` has what they mean for some triangles.
    """
    kept = (
        options.budget, options.resolution, options.moves, options.conservative, options.overhang,
        options.seed, VERSION,
    )  # fmt: skip
    return _digest(_FORMAT, repr(kept).encode())


def leaf_key(mesh: bytes, kind: NodeKind, stand: Stand, options: bytes) -> str:
    """Of an occluder of a mesh, in the mesh's own space."""
    return _digest(kind.encode(), mesh, _stand_bytes(stand), options).hex()[:_DIGITS]


def keys_at_places(meshes: Sequence[bytes], transforms: FloatArray) -> NDArray[np.uint8]:
    """(n, 32) of meshes, each at its place in the world."""
    # Both of one length each, so no lengths are needed to tell them apart; scenes have many.
    made = (
        hashlib.sha256(b"placed" + mesh + transform.tobytes()).digest()
        for mesh, transform in zip(meshes, transforms, strict=True)
    )
    return np.frombuffer(b"".join(made), dtype=np.uint8).reshape(-1, hashlib.sha256().digest_size)


def node_key(below: NDArray[np.uint8], stand: Stand, options: bytes) -> str:
    """Of an inner node from the keys of all parts below it, in an order that they alone decide."""
    return _digest(b"inner", _stand_bytes(stand), options, below.tobytes()).hex()[:_DIGITS]


def is_key(text: str) -> bool:
    """Whether a text can be a key, and so is safe as the name of a file."""
    return _KEY.fullmatch(text) is not None


def _stand_bytes(stand: Stand) -> bytes:
    return repr((stand.ground, stand.smallest_hole)).encode()


def _digest(*pieces: bytes) -> bytes:
    made = hashlib.sha256()
    for piece in pieces:
        made.update(len(piece).to_bytes(8, "little"))
        made.update(piece)
    return made.digest()
