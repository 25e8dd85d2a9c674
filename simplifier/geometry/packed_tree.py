"""PackedTree: a scene's tree and its occluders in a few arrays, as engines read them.

Unlike an OccluderTree, which a build makes, it holds what a frame needs and in the numbers that a
frame computes with: boxes and errors in float32, rounded so that nothing is hidden for it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.options.simplify import Axis

NONE = 0xFFFFFFFF
"""In place of a mesh: the node has no such occluder."""

MOST_SHORT = 65_535
"""Vertices of a mesh with 16-bit indices; the last index means "restart" to some."""

NODE = np.dtype([
    ("low", "<f4", 3), ("high", "<f4", 3),
    ("far", "<u4"), ("near", "<u4"),
    ("far_error", "<f4"), ("switch_error", "<f4"), ("far_radius", "<f4"), ("near_radius", "<f4"),
    ("first_child", "<u4"), ("child_count", "<u4"),
    ("first_part", "<u4"), ("part_count", "<u4"),
])  # fmt: skip
"""64 bytes.

``low``, ``high``  of the box, relative to the tree's origin, rounded outwards.
``far``, ``near``  meshes, or NONE.  Those of a leaf are in the space of its part's mesh, that of an
                   inner node, which has no near one, in the world.
``far_error``      how far the far occluder may stray, world units, rounded up; near ones have none.
``switch_error``   what decides whether it is drawn: ``far_error``, but no less than what it lacks.
``far_radius``, ``near_radius``  of the discs that hide as much, world units; 0 for none.
``first_child``, ``child_count``  children follow each other, in the order of their parents; a leaf
                   has none.
``first_part``, ``part_count``  places in ``order`` of the parts below; a leaf has one.
"""

PART = np.dtype([("object", "<u4"), ("transform", "<u4"), ("node", "<u4")])
"""12 bytes: the object that it is a piece of, its transform, and its leaf."""

MESH = np.dtype([
    ("origin", "<f8", 3),
    ("first_vertex", "<u4"), ("vertex_count", "<u4"),
    ("first_index", "<u4"), ("triangle_count", "<u4"),
    ("first_pair", "<u4"), ("pair_count", "<u4"),
])  # fmt: skip
"""48 bytes.

``origin``       that its positions are relative to.
``first_index``  where its indices begin, in units of 4 bytes; they have 2 bytes each up to
                 MOST_SHORT vertices, else 4.
"""


@dataclass(frozen=True, eq=False)
class PackedTree:
    """Node 0 is the root, parents come before their children; a mesh is an occluder.

    ``objects``      names; each once.
    ``up``           the scene's up axis.
    ``conservative`` whether all occluders keep wholly inside of closed objects, so that drawn into
                     the pixels that they cover wholly they hide nothing wrongly.
    ``pixel_error``, ``rows``, ``fov``  the error on the screen, in pixels, that the tree was built
                     for, the height of that screen and its vertical field of view, degrees.
    ``origin``       (3,) float64, world units: of the nodes' boxes.
    ``nodes``        (k,) :data:`NODE`.
    ``parts``        (p,) :data:`PART`, in the scene's order: those of an object follow each other.
    ``order``        (p,) uint32: the parts in the order of the leaves, depth first.
    ``transforms``   (t, 3, 4) float64: from the space of a mesh to the world, each once.
    ``meshes``       (m,) :data:`MESH`.
    ``positions``    (v, 3) float32.
    ``indices``      (w,) uint32 words: the corners of all triangles, of 2 or 4 bytes.
    ``pairs``        (e, 2) uint32: corners of one mesh that lie opposite of an edge which two of
                     its triangles share; there for inner coverage, so only if ``conservative``.
    ``worth``        (k,) float32 or None: how much drawing a node's occluders is worth where there
                     is room for few triangles, 0 or more; 1 is usual.
    ``about``        how it was made; nothing in it changes what is drawn.
    """

    objects: tuple[str, ...]
    up: Axis
    conservative: bool
    pixel_error: float
    rows: int
    fov: float
    origin: FloatArray
    nodes: NDArray[np.void]
    parts: NDArray[np.void]
    order: NDArray[np.uint32]
    transforms: FloatArray
    meshes: NDArray[np.void]
    positions: NDArray[np.float32]
    indices: NDArray[np.uint32]
    pairs: NDArray[np.uint32]
    worth: NDArray[np.float32] | None
    about: Mapping[str, Any]

    def __repr__(self) -> str:
        held = f"{len(self.objects):,} objects, {len(self.nodes):,} nodes"
        return f"<PackedTree: {held}, {len(self.meshes):,} occluders>"

    @property
    def boxes(self) -> FloatArray:
        """(k, 2, 3) lowest and highest corner of each node's box, world units."""
        relative = np.stack([self.nodes["low"], self.nodes["high"]], axis=1)
        return np.asarray(relative.astype(np.float64) + self.origin)

    @property
    def object_of(self) -> IntArray:
        """(p,) int32: the object that each part belongs to."""
        return self.parts["object"].astype(np.int32)

    def mesh(self, index: int) -> tuple[FloatArray, IntArray]:
        """Vertices (n, 3) float64 in its own space, and faces (m, 3) int32, of one occluder."""
        row = self.meshes[index]
        first, count = int(row["first_vertex"]), int(row["vertex_count"])
        vertices = self.positions[first : first + count].astype(np.float64) + row["origin"]
        return vertices, faces_of(row, self.indices)


def index_type(vertex_count: int) -> np.dtype[Any]:
    """Of the indices of a mesh."""
    return np.dtype("<u2" if vertex_count <= MOST_SHORT else "<u4")


def index_words(vertex_count: int, triangle_count: int) -> int:
    """How many words of 4 bytes a mesh's indices take."""
    return -(-3 * triangle_count * index_type(vertex_count).itemsize // 4)


def faces_of(row: np.void, indices: NDArray[np.uint32]) -> IntArray:
    """(m, 3) int32 of the mesh that is a row of :data:`MESH`."""
    vertices, triangles = int(row["vertex_count"]), int(row["triangle_count"])
    first, words = int(row["first_index"]), index_words(vertices, triangles)
    corners = indices[first : first + words].view(index_type(vertices))[: 3 * triangles]
    return corners.reshape(-1, 3).astype(np.int32)
