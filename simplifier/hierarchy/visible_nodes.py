"""Which nodes of a tree to draw for a camera: the cut by screen-space error (section 5)."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.packed_tree import NONE, PackedTree
from simplifier.hierarchy.occluder_tree import FAR, NEAR
from simplifier.hierarchy.tree import Tree

_NONE = -1

_SMALLEST = 1.0
"""Pixels: what hides no more than a disc of this radius would cover no box that is worth a test."""


def never(node: int) -> bool:
    """Skip no node."""
    return False


@dataclass(frozen=True, eq=False)
class CutFinder:
    """What of a tree does not depend on the camera.

    ``errors``, ``radii``  (k, 2) of the nodes' far and near occluders, world units.  A far one that
                     keeps wholly inside never errs but lacks as much, which counts the same.
    ``sizes``  (k,) diagonals of the nodes' boxes.
    ``triangles``  (k, 2) of the occluders, and
    ``worth``  (k,) what they are worth, for walks with a budget.

    ``integrations/c/occluder_tree.h`` finds the same, bit by bit.
    """

    tree: Tree
    errors: FloatArray
    radii: FloatArray
    sizes: FloatArray
    triangles: IntArray | None = None
    worth: FloatArray | None = None

    @classmethod
    def of(cls, packed: PackedTree) -> CutFinder:
        nodes = packed.nodes
        children = np.column_stack([nodes["first_child"], nodes["child_count"]])
        begin = nodes["first_part"].astype(np.int32)
        spans = np.column_stack([begin, begin + nodes["part_count"].astype(np.int32)])
        bounds = packed.boxes
        tree = Tree(bounds, children.astype(np.int32), spans, packed.order.astype(np.int32))
        found = np.column_stack([nodes["far"], nodes["near"]])
        errors = np.where(found[:, :1] != NONE, nodes["switch_error"][:, None], np.inf)
        errors = np.column_stack([errors, np.where(found[:, 1:] != NONE, 0.0, np.inf)])
        radii = np.column_stack([nodes["far_radius"], nodes["near_radius"]]).astype(np.float64)
        counts = np.append(packed.meshes["triangle_count"].astype(np.int32), np.int32(0))
        worth = np.ones(len(nodes)) if packed.worth is None else packed.worth.astype(np.float64)
        return cls(
            tree, errors.astype(np.float64), np.where(found != NONE, radii, 0.0),
            _lengths(bounds[:, 1] - bounds[:, 0]),
            counts[np.where(found != NONE, found, len(counts) - 1)], worth,
        )  # fmt: skip

    def cut(
        self,
        camera: Camera,
        focal: float,
        pixel_error: float,
        skip: Callable[[int], bool] = never,
        most_triangles: int | None = None,
    ) -> Iterator[tuple[int, int]]:
        """(node, level) of the occluders to draw, near nodes first; level FAR or NEAR.

        ``focal``        pixels that a unit length takes at unit distance.
        ``pixel_error``  a node's far occluder is drawn when its error stays within.
        ``skip``         asked of each node that is reached, whether to leave it out with all below
                         it, after those before it were drawn: what is hidden hides nothing.
        ``most_triangles``  of all that is drawn; then what hides most of the screen comes first,
                         by worth * radius / distance, as far as the triangles go.

        A node whose error is too large is opened: always so when the camera may be inside of the
        occluder, within its error of the node's box.  A leaf has its near occluder then, or
        nothing: so nothing is ever hidden wrongly by more than the pixel error (as it is in the
        middle of the picture: towards a corner a pixel sees less) and the overhang of near ones.
        """
        distances = self._distances(camera)
        found = self._levels(distances, focal, pixel_error)
        keys = distances if most_triangles is None else self._keys(distances, found)
        levels, children = found.tolist(), self.tree.children.tolist()
        large = self.sizes * focal >= _SMALLEST * distances
        waiting, left = [(float(keys[0]), 0)], most_triangles
        while waiting and left != 0:
            key, node = heapq.heappop(waiting)
            if skip(node):
                continue
            if levels[node] != _NONE:
                if left is not None and self.triangles is not None:
                    count = int(self.triangles[node, levels[node]])
                    if count > left or key == 0.0:
                        continue
                    left -= count
                yield node, levels[node]
                continue
            first, count = children[node]
            for child in range(first, first + count):
                if large[child]:
                    heapq.heappush(waiting, (float(keys[child]), child))

    def _distances(self, camera: Camera) -> FloatArray:
        """(k,) from the camera to the nearest point of each box, 0 inside."""
        bounds = self.tree.bounds
        away = np.maximum(bounds[:, 0] - camera.position, camera.position - bounds[:, 1])
        return _lengths(np.maximum(away, 0.0))

    def _keys(self, distances: FloatArray, levels: IntArray) -> FloatArray:
        """(k,) that put first what hides most of the screen, and 0 for what is worth nothing.

        Nothing below a node that is opened hides more than a disc around its box.
        """
        worth = np.ones(len(levels)) if self.worth is None else self.worth
        radii = self.radii[np.arange(len(levels)), np.maximum(levels, 0)]
        shown = np.where(levels == _NONE, worth.max() * (0.5 * self.sizes), worth * radii)
        with np.errstate(divide="ignore", invalid="ignore"):
            keys = -(shown / distances)
        return np.where(distances > 0.0, keys, np.where(shown > 0.0, -np.inf, 0.0))

    def _levels(self, distances: FloatArray, focal: float, pixel_error: float) -> IntArray:
        """(k,) which of a node's occluders is exact enough and large enough to hide; -1 for none.

        The nearest point of an occluder may be nearer than the node's box by its error.
        """
        away = distances[:, None]
        sharp = (self.errors * focal <= pixel_error * (away - self.errors)) | (self.errors == 0.0)
        usable = sharp & (self.radii * focal >= _SMALLEST * away) & (self.radii > 0.0)
        return np.where(usable[:, FAR], FAR, np.where(usable[:, NEAR], NEAR, _NONE))


def _lengths(vectors: FloatArray) -> FloatArray:
    """(k,) of vectors (k, 3), summed in the order that C sums in."""
    x, y, z = vectors.T
    with np.errstate(over="ignore"):  # of a damaged tree: infinite will do
        return np.asarray(np.sqrt((x * x + y * y) + z * z))
