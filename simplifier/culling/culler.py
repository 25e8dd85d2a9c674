"""Camera -> Culled: draw the occluders of a scene from near to far, and test all of its parts.

``integrations/c/occluder_tree.h`` does the same, bit by bit, and does it here where it could be
compiled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.checks import check_kind, check_whole, check_within
from simplifier.culling.depth_buffer import DepthBuffer, Verdict, in_frustum
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.packed_tree import PackedTree, faces_of
from simplifier.geometry.solid import BoolArray
from simplifier.hierarchy.occluder_tree import FAR, OccluderTree
from simplifier.hierarchy.packing import pack_tree
from simplifier.hierarchy.visible_nodes import CutFinder
from simplifier.io.occs_file import encode_occs
from simplifier.kernels.native import NativeTree, address

_ALL = 0xFFFFFFFF  # in place of a budget
_A_TREE = "what simplify_scene, load_occluder_tree or load_packed_tree returns"


@dataclass(frozen=True, eq=False)
class Culled:
    """One frame.

    ``verdicts``   (p,) of the parts, :class:`Verdict`.
    ``drawn``      (node, level) of the occluders that were drawn, in the order of drawing.
    ``triangles``  of these.
    """

    verdicts: NDArray[np.uint8]
    drawn: tuple[tuple[int, int], ...]
    triangles: int


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Of an occluder, in its own space around ``origin``."""

    positions: NDArray[np.float32]
    faces: IntArray
    pairs: NDArray[np.uint32]
    origin: FloatArray


class Culler:
    """Culls a scene frame by frame; ``buffer`` holds the last one.

    With a buffer of inner coverage and occluders that keep wholly inside of closed objects nothing
    is ever hidden wrongly.
    """

    def __init__(
        self,
        tree: OccluderTree | PackedTree,
        buffer: DepthBuffer,
        pixel_error: float | None = None,
        most_triangles: int | None = None,
    ) -> None:
        """``pixel_error`` of what is drawn, pixels of the buffer; that of the build if None.

        ``most_triangles``  a frame; what hides most of the screen is drawn first then.

        Raises :class:`~simplifier.errors.OutputError` where the scene does not fit float32, and
        :class:`~simplifier.errors.OptionError` for arguments of another kind or out of range.
        """
        check_kind("tree", tree, OccluderTree | PackedTree, _A_TREE)
        check_kind("buffer", buffer, DepthBuffer, "a simplifier.DepthBuffer")
        if pixel_error is not None:
            check_within("pixel_error", pixel_error, 0.0, math.inf)
        if most_triangles is not None:
            check_whole("most_triangles", most_triangles, 0, _ALL)
        self.packed = tree if isinstance(tree, PackedTree) else pack_tree(tree)
        self.buffer = buffer
        self.pixel_error = self.packed.pixel_error if pixel_error is None else pixel_error
        self.most_triangles = most_triangles
        self._finder = CutFinder.of(self.packed)
        self._part_boxes = self.packed.boxes[self.packed.parts["node"]]
        self._meshes: dict[int, _Mesh] = {}
        self._native: NativeTree | None = None

    def in_frustum(self, camera: Camera) -> BoolArray:
        """(p,) the parts whose box is not wholly beside the view frustum."""
        return in_frustum(self._part_boxes, camera, self.buffer.rows, self.buffer.columns)

    def cull(self, camera: Camera) -> Culled:
        """Draw the cut from near to far, leaving out what is hidden by then, and test all parts.

        Hidden nodes are not opened, in either pass: what hides their box hides all that is in it.
        Raises :class:`~simplifier.errors.OptionError` for what is no camera.
        """
        check_kind("camera", camera, Camera, "a simplifier.Camera")
        self.buffer.clear()
        if self.buffer.native is not None:
            return self._cull_by_header(camera)
        focal = Lens(self.buffer.rows, camera.fov).focal
        boxes = self._finder.tree.bounds

        def skip(node: int) -> bool:
            found = self.buffer.test(boxes[node : node + 1], camera)
            return bool(found[0] != Verdict.VISIBLE)

        drawn, triangles = [], 0
        for node, level in self._finder.cut(
            camera, focal, self.pixel_error, skip, self.most_triangles
        ):
            triangles += self.draw(node, level, camera)
            drawn.append((node, level))
        return Culled(self._verdicts(camera), tuple(drawn), triangles)

    def _cull_by_header(self, camera: Camera) -> Culled:
        if self._native is None:
            self._native = NativeTree(encode_occs(self.packed))
        tree, verdicts = self._native, np.empty(len(self._part_boxes), dtype=np.uint8)
        most = _ALL if self.most_triangles is None else min(self.most_triangles, _ALL - 1)
        header = self.buffer.as_header_has_it(camera, tree.most_vertices)
        counts = tree.cull(header, self.pixel_error, most, address(verdicts))
        drawn = tree.drawn[: counts.occluders].tolist()
        return Culled(verdicts, tuple((node, level) for node, level in drawn), counts.triangles)

    def draw(self, node: int, level: int, camera: Camera) -> int:
        """Draw an occluder; how many triangles it has."""
        row = self.packed.nodes[node]
        mesh = self._mesh(int(row["far"] if level == FAR else row["near"]))
        rows = np.eye(3, 4)
        if row["child_count"] == 0:
            part = self.packed.parts[self.packed.order[row["first_part"]]]
            rows = self.packed.transforms[part["transform"]]
        self.buffer.draw_placed(
            mesh.positions, mesh.faces, _around(rows, mesh.origin, camera.position), camera,
            float(row["far_error"]) if level == FAR else 0.0, mesh.pairs,
        )  # fmt: skip
        return len(mesh.faces)

    def _mesh(self, index: int) -> _Mesh:
        """Kept for later frames."""
        if index not in self._meshes:
            row, packed = self.packed.meshes[index], self.packed
            first, pair = int(row["first_vertex"]), int(row["first_pair"])
            positions = packed.positions[first : first + int(row["vertex_count"])]
            pairs = packed.pairs[pair : pair + int(row["pair_count"])]
            self._meshes[index] = _Mesh(
                np.require(positions, np.float32, ["C", "W"]), faces_of(row, packed.indices),
                np.require(pairs, np.uint32, ["C", "W"]), row["origin"].astype(np.float64),
            )  # fmt: skip
        return self._meshes[index]

    def _verdicts(self, camera: Camera) -> NDArray[np.uint8]:
        """Of the parts, level by level: a node that is not visible settles all below it."""
        tree = self._finder.tree
        leaf = tree.children[:, 1] == 0
        verdicts = np.empty(len(tree.order), dtype=np.uint8)
        level = np.zeros(1, dtype=np.int32)
        while len(level):
            found = self.buffer.test(tree.bounds[level], camera)
            opened = (found == Verdict.VISIBLE) & ~leaf[level]
            for node, verdict in zip(level[~opened].tolist(), found[~opened], strict=True):
                verdicts[tree.below(node)] = verdict
            level = _children(tree.children[level[opened]])
        return verdicts


def _around(rows: FloatArray, origin: FloatArray, eye: FloatArray) -> NDArray[np.float32]:
    """(12,) rows that take what is around ``origin``, placed by ``rows`` (3, 4), around the eye."""
    a, b, c, d = rows.T
    with np.errstate(over="ignore", invalid="ignore"):  # of a damaged tree: it is not drawn then
        placed = ((a * origin[0] + b * origin[1]) + c * origin[2]) + d
        return np.column_stack([rows[:, :3], placed - eye]).astype(np.float32).reshape(-1)


def _children(ranges: IntArray) -> IntArray:
    """All of the nodes that rows (first, count) name."""
    first, counts = ranges[:, 0], ranges[:, 1]
    starts = np.cumsum(counts) - counts
    steps = np.arange(counts.sum(), dtype=np.int32) - np.repeat(starts, counts)
    return np.asarray(np.repeat(first, counts) + steps, dtype=np.int32)
