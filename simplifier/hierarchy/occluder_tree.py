"""OccluderTree: a scene's tree with an occluder for each node that is worth one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import scales
from simplifier.hierarchy.options import SceneOptions
from simplifier.hierarchy.tree import Tree

_NONE = -1


@dataclass(frozen=True, eq=False)
class OccluderTree:
    """What a renderer needs at run time.

    ``options``      what it was built with.
    ``objects``      names; each once.
    ``object_of``    (p,) int32: the object that each part belongs to.
    ``tree``         over the parts' boxes, world units.
    ``transforms``   (p, 4, 4) float64: of each part, from its mesh to the world.
    ``occluder_of``  (k,) int32: the occluder of each node, -1 for none.  That of a leaf is in the
                     space of its part's mesh, that of an inner node in the world.
    ``occluders``    shared by the instances of a mesh.
    ``radii``        of the disc that hides as much as each occluder; see ``hiding_radius``.
    """

    options: SceneOptions
    objects: tuple[str, ...]
    object_of: IntArray
    tree: Tree
    transforms: FloatArray
    occluder_of: IntArray
    occluders: tuple[Occluder, ...]
    radii: FloatArray

    def part_of(self, leaf: int) -> int:
        return int(self.tree.order[self.tree.spans[leaf, 0]])

    def triangles(self, node: int) -> FloatArray:
        """(m, 3, 3) of a node's occluder, world units; m is 0 without one."""
        which = self.occluder_of[node]
        if which == _NONE:
            return np.empty((0, 3, 3))
        points = self.occluders[which].vertices
        if self.tree.children[node, 1] == 0:
            transform = self.transforms[self.part_of(node)]
            points = points @ transform[:3, :3].T + transform[:3, 3]
        return np.asarray(points[self.occluders[which].faces])

    def errors(self) -> FloatArray:
        """(k,) how far each node's occluder may stray, world units; infinite without one."""
        bounds = np.array([occluder.error_bound for occluder in self.occluders] + [np.inf])
        return np.asarray(bounds[self.occluder_of] * self._stretch())

    def hiding_radii(self) -> FloatArray:
        """(k,) world units; 0 without an occluder."""
        return np.asarray(np.append(self.radii, 0.0)[self.occluder_of] * self._stretch())

    def _stretch(self) -> FloatArray:
        """(k,) how much the transform of a leaf enlarges lengths, at most; 1 for inner nodes."""
        result = np.ones(len(self.tree))
        leaves = np.nonzero(self.tree.is_leaf)[0]
        parts = self.tree.order[self.tree.spans[leaves, 0]]
        result[leaves] = scales(self.transforms[parts])
        return result
