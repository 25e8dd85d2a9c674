"""What the occluders of a scene hide from a camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.culling.depth_buffer import DepthBuffer, Verdict, shared_edges
from simplifier.geometry.camera import Camera, Lens
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.hierarchy.occluder_tree import OccluderTree
from simplifier.hierarchy.visible_nodes import CutFinder


@dataclass(frozen=True, eq=False)
class Culled:
    """One frame.

    ``verdicts``   (p,) of the parts, :class:`Verdict`.
    ``drawn``      (node, level) of the occluders that were drawn, near ones first.
    ``triangles``  of these.
    """

    verdicts: NDArray[np.uint8]
    drawn: tuple[tuple[int, int], ...]
    triangles: int


@dataclass(frozen=True, eq=False)
class _Placed:
    """An occluder in the world; ``edges`` that its triangles share, for inner coverage alone."""

    vertices: FloatArray
    faces: IntArray
    error: float
    edges: IntArray | None


class Culler:
    """Culls a scene frame by frame; ``buffer`` holds the last one.

    With a buffer of inner coverage and occluders that keep wholly inside of closed objects nothing
    is ever hidden wrongly.
    """

    def __init__(
        self, tree: OccluderTree, buffer: DepthBuffer, pixel_error: float | None = None
    ) -> None:
        """``pixel_error`` of what is drawn, pixels of the buffer; that of the build if None."""
        self.tree, self.buffer = tree, buffer
        self.pixel_error = tree.options.pixel_error if pixel_error is None else pixel_error
        self._finder = CutFinder.of(tree)
        self._bounds = np.ascontiguousarray(tree.tree.bounds)
        self._leaf = tree.tree.is_leaf
        self._placed: dict[tuple[int, int], _Placed] = {}

    def cull(self, camera: Camera) -> Culled:
        """Draw the cut from near to far, leaving out what is hidden by then, and test all parts.

        Hidden nodes are not opened, in either pass: what hides their box hides all that is in it.
        """
        buffer = self.buffer
        buffer.clear()
        focal = Lens(buffer.rows, camera.fov).focal

        def skip(node: int) -> bool:
            return bool(buffer.test(self._bounds[node : node + 1], camera)[0] != Verdict.VISIBLE)

        drawn, triangles = [], 0
        for node, level in self._finder.cut(camera, focal, self.pixel_error, skip):
            mesh = self._occluder(node, level)
            buffer.draw_mesh(mesh.vertices, mesh.faces, camera, mesh.error, mesh.edges)
            drawn.append((node, level))
            triangles += len(mesh.faces)
        return Culled(self._verdicts(camera), tuple(drawn), triangles)

    def _occluder(self, node: int, level: int) -> _Placed:
        """Kept for later frames."""
        if (node, level) not in self._placed:
            vertices, faces, error = self.tree.placed(node, level)
            edges = shared_edges(faces) if self.buffer.coverage == "inner" else None
            self._placed[node, level] = _Placed(vertices, faces, error, edges)
        return self._placed[node, level]

    def _verdicts(self, camera: Camera) -> NDArray[np.uint8]:
        """Of the parts, level by level: a node that is not visible settles all below it."""
        tree = self.tree.tree
        verdicts = np.empty(len(tree.order), dtype=np.uint8)
        level = np.zeros(1, dtype=np.int32)
        while len(level):
            found = self.buffer.test(self._bounds[level], camera)
            opened = (found == Verdict.VISIBLE) & ~self._leaf[level]
            for node, verdict in zip(level[~opened].tolist(), found[~opened], strict=True):
                verdicts[tree.below(node)] = verdict
            level = _children(tree.children[level[opened]])
        return verdicts


def _children(ranges: IntArray) -> IntArray:
    """All of the nodes that rows (first, count) name."""
    first, counts = ranges[:, 0], ranges[:, 1]
    starts = np.cumsum(counts) - counts
    steps = np.arange(counts.sum(), dtype=np.int32) - np.repeat(starts, counts)
    return np.asarray(np.repeat(first, counts) + steps, dtype=np.int32)
