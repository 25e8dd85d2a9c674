"""Which nodes of a tree to draw for a camera: the cut by screen-space error (section 5)."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from simplifier.geometry.camera import Camera
from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.hierarchy.node import COARSENESS
from simplifier.hierarchy.occluder_tree import FAR, NEAR, OccluderTree
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
    """

    tree: Tree
    errors: FloatArray
    radii: FloatArray
    sizes: FloatArray

    @classmethod
    def of(cls, occluders: OccluderTree) -> CutFinder:
        tree = occluders.tree
        extents = tree.bounds[:, 1] - tree.bounds[:, 0]
        errors = occluders.errors()
        with np.errstate(over="ignore"):  # of a damaged tree: infinite will do
            coarse = COARSENESS * extents.max(axis=1) / occluders.options.resolution
            sizes = np.asarray(np.linalg.norm(extents, axis=1))
        errors[:, FAR] = np.maximum(errors[:, FAR], coarse)
        return cls(tree, errors, occluders.hiding_radii(), sizes)

    def cut(
        self,
        camera: Camera,
        focal: float,
        pixel_error: float,
        skip: Callable[[int], bool] = never,
    ) -> Iterator[tuple[int, int]]:
        """(node, level) of the occluders to draw, near nodes first; level FAR or NEAR.

        ``focal``        pixels that a unit length takes at unit distance.
        ``pixel_error``  a node's far occluder is drawn when its error stays within.
        ``skip``         asked of each node that is reached, whether to leave it out with all below
                         it, after those before it were drawn: what is hidden hides nothing.

        A node whose error is too large is opened: always so when the camera may be inside of the
        occluder, within its error of the node's box.  A leaf has its near occluder then, or
        nothing: so nothing is ever hidden wrongly by more than the pixel error (as it is in the
        middle of the picture: towards a corner a pixel sees less) and the overhang of near ones.
        """
        distances = self._distances(camera)
        levels = self._levels(distances, focal, pixel_error).tolist()
        children = self.tree.children.tolist()
        large = self.sizes * focal >= _SMALLEST * distances
        waiting = [(0.0, 0)]
        while waiting:
            _, node = heapq.heappop(waiting)
            if skip(node):
                continue
            if levels[node] != _NONE:
                yield node, levels[node]
                continue
            first, count = children[node]
            for child in range(first, first + count):
                if large[child]:
                    heapq.heappush(waiting, (float(distances[child]), child))

    def _distances(self, camera: Camera) -> FloatArray:
        """(k,) from the camera to the nearest point of each box, 0 inside."""
        bounds = self.tree.bounds
        away = np.maximum(bounds[:, 0] - camera.position, camera.position - bounds[:, 1])
        return np.asarray(np.linalg.norm(np.maximum(away, 0.0), axis=1))

    def _levels(self, distances: FloatArray, focal: float, pixel_error: float) -> IntArray:
        """(k,) which of a node's occluders is exact enough and large enough to hide; -1 for none.

        The nearest point of an occluder may be nearer than the node's box by its error.
        """
        away = distances[:, None]
        sharp = (self.errors * focal <= pixel_error * (away - self.errors)) | (self.errors == 0.0)
        usable = sharp & (self.radii * focal >= _SMALLEST * away) & (self.radii > 0.0)
        return np.where(usable[:, FAR], FAR, np.where(usable[:, NEAR], NEAR, _NONE))
