"""OccluderTree -> PackedTree: what a build made, in the arrays that a frame reads.

Occluder -> WeldedMesh: its triangles as those arrays have them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import check_kind
from simplifier.errors import OutputError
from simplifier.geometry.arrays import rounded_up
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.packed_tree import (
    MESH,
    NODE,
    NONE,
    PART,
    PackedTree,
    faces_of,
    index_type,
    index_words,
)
from simplifier.geometry.weld import edge_pairs, weld
from simplifier.hierarchy.node import COARSENESS
from simplifier.hierarchy.occluder_tree import FAR, NEAR, NodeTree, OccluderTree
from simplifier.io.float32 import box_centre, to_float32
from simplifier.version import VERSION


@dataclass(frozen=True, eq=False)
class WeldedMesh:
    """Triangles around an ``origin`` (3,) float64: ``positions`` (n, 3) float32, each once, and
    ``faces`` (m, 3) int32."""

    origin: FloatArray
    positions: NDArray[np.float32]
    faces: IntArray

    @classmethod
    def of(cls, occluder: Occluder) -> WeldedMesh:
        """Raises :class:`~simplifier.errors.OutputError` where it does not fit float32."""
        origin = box_centre(occluder.vertices[occluder.faces].reshape(-1, 3))
        return cls(origin, *weld(to_float32(occluder.vertices - origin), occluder.faces))

    @classmethod
    def packed(cls, tree: PackedTree, index: int) -> WeldedMesh:
        """One of those that a tree was packed with."""
        row = tree.meshes[index]
        first, count = int(row["first_vertex"]), int(row["vertex_count"])
        positions = tree.positions[first : first + count]
        return cls(row["origin"].copy(), positions, faces_of(row, tree.indices))


def pack_tree(tree: OccluderTree) -> PackedTree:
    """The same tree with its occluders welded; the same tree gives the same arrays.

    Raises :class:`~simplifier.errors.OutputError` where the scene does not fit float32.
    """
    check_kind("tree", tree, OccluderTree, "what simplifier.load_occluder_tree returns")
    return pack_meshes(tree, map(WeldedMesh.of, tree.occluders))


def pack_meshes(tree: NodeTree, occluders: Iterable[WeldedMesh]) -> PackedTree:
    """As :func:`pack_tree`, of occluders that are welded already."""
    options = tree.options
    transforms, transform_of = _each_once(tree.transforms[:, :3])
    origin = box_centre(tree.tree.bounds[:1].reshape(-1, 3))
    meshes = _Meshes(with_pairs=options.conservative)
    for occluder in occluders:
        meshes.add(occluder)
    parts = np.zeros(len(tree.object_of), dtype=PART)
    parts["object"], parts["transform"] = tree.object_of, transform_of
    leaves = np.nonzero(tree.tree.is_leaf)[0]
    parts["node"][tree.tree.order[tree.tree.spans[leaves, 0]]] = leaves
    return PackedTree(
        tree.objects, options.up, options.conservative, options.pixel_error, options.rows,
        options.fov, origin, _nodes(tree, origin), parts, tree.tree.order.astype(np.uint32),
        transforms, *meshes.arrays(), worth=None,
        about={"made by": f"planar-occluder {VERSION}", "options": options.chosen()},
    )  # fmt: skip


def _each_once(transforms: FloatArray) -> tuple[FloatArray, NDArray[np.uint32]]:
    """Transforms (t, 3, 4) in the order of first use, and (p,) which of them each one is."""
    known: dict[bytes, int] = {}
    places = [known.setdefault(one.tobytes(), len(known)) for one in transforms]
    each = np.frombuffer(b"".join(known)).reshape(-1, 3, 4)
    return each, np.array(places, dtype=np.uint32)


def _nodes(tree: NodeTree, origin: FloatArray) -> NDArray[np.void]:
    """A far occluder that keeps wholly inside never errs but lacks as much as it is coarse, which
    decides alike whether it is drawn.
    """
    bounds, errors, radii = tree.tree.bounds, tree.errors(), tree.hiding_radii()
    has = tree.occluder_of >= 0
    with np.errstate(over="ignore"):  # what is so large does not fit float32, and is refused below
        extents = bounds[:, 1] - bounds[:, 0]
        coarse = COARSENESS * extents.max(axis=1) / tree.options.resolution
    errors = np.where(has, errors, 0.0)
    nodes = np.zeros(len(tree.tree), dtype=NODE)
    low, high = _float32(bounds[:, 0] - origin), _float32(bounds[:, 1] - origin)
    nodes["low"] = np.nextafter(low, -np.inf, where=low + origin > bounds[:, 0], out=low)
    nodes["high"] = np.nextafter(high, np.inf, where=high + origin < bounds[:, 1], out=high)
    found = np.where(has, tree.occluder_of, NONE)
    nodes["far"], nodes["near"] = found[:, FAR], found[:, NEAR]
    nodes["far_error"] = _rounded_up(errors[:, FAR])
    switch = np.where(has[:, FAR], np.maximum(errors[:, FAR], coarse), 0.0)
    nodes["switch_error"] = _rounded_up(switch)
    discs = _float32(np.where(has, radii, 0.0))
    nodes["far_radius"], nodes["near_radius"] = discs[:, FAR], discs[:, NEAR]
    nodes["first_child"], nodes["child_count"] = tree.tree.children.T
    nodes["first_part"] = tree.tree.spans[:, 0]
    nodes["part_count"] = tree.tree.spans[:, 1] - tree.tree.spans[:, 0]
    return nodes


def _float32(values: FloatArray) -> NDArray[np.float32]:
    """The nearest.  Raises :class:`OutputError` where one would be infinite."""
    with np.errstate(over="ignore", under="ignore"):
        rounded = values.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise OutputError(
            "the scene is too large for 32-bit numbers", remedy="scale it down, or split it"
        )
    return rounded


def _rounded_up(values: FloatArray) -> NDArray[np.float32]:
    _float32(values)  # raises where they are too large
    return rounded_up(values)


@dataclass
class _Meshes:
    """Collects occluders end to end."""

    with_pairs: bool
    rows: list[tuple[object, ...]] = field(default_factory=list)
    positions: list[NDArray[np.float32]] = field(default_factory=list)
    indices: list[bytes] = field(default_factory=list)
    pairs: list[NDArray[np.uint32]] = field(default_factory=list)
    vertices: int = 0
    words: int = 0
    pair_count: int = 0

    def add(self, occluder: WeldedMesh) -> None:
        origin, positions, faces = occluder.origin, occluder.positions, occluder.faces
        words = index_words(len(positions), len(faces))
        pairs = edge_pairs(faces) if self.with_pairs else np.empty((0, 2), dtype=np.uint32)
        self.rows.append((
            origin, self.vertices, len(positions), self.words, len(faces), self.pair_count,
            len(pairs),
        ))  # fmt: skip
        self.positions.append(positions)
        self.indices.append(
            faces.astype(index_type(len(positions))).tobytes().ljust(4 * words, b"\0")
        )
        self.pairs.append(pairs)
        self.vertices += len(positions)
        self.words += words
        self.pair_count += len(pairs)

    def arrays(
        self,
    ) -> tuple[NDArray[np.void], NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32]]:
        """Meshes, positions, indices and pairs."""
        return (
            np.array(self.rows, dtype=MESH),
            np.concatenate([np.empty((0, 3), dtype=np.float32), *self.positions]),
            np.frombuffer(b"".join(self.indices), dtype="<u4"),
            np.concatenate([np.empty((0, 2), dtype=np.uint32), *self.pairs]),
        )
