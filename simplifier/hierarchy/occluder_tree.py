"""OccluderTree: a scene's tree with the occluders of the nodes that are worth one.

TreeOutline: all of it but the triangles of the occluders.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import EmptyMeshError
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.geometry.occluder import Occluder
from simplifier.geometry.scene import Scene, scales
from simplifier.hierarchy.tree import Tree
from simplifier.options.scene import SceneOptions
from simplifier.wording import count

LEVELS = ("far", "near")
"""A node's occluders: with an error that shows from near by; narrow, for leaves alone."""

FAR, NEAR = range(2)


@dataclass(frozen=True, eq=False)
class NodeTree:
    """A scene's tree, and which occluders its nodes have.

    ``options``      what it was built with.
    ``objects``      names; each once.
    ``object_of``    (p,) int32: the object that each part belongs to.
    ``tree``         over the parts' boxes, world units.
    ``transforms``   (p, 4, 4) float64: of each part, from its mesh to the world.
    ``occluder_of``  (k, 2) int32: the far and the near occluder of each node, -1 for none.  Those
                     of a leaf are in the space of its part's mesh, that of an inner node in the
                     world.
    """

    options: SceneOptions
    objects: tuple[str, ...]
    object_of: IntArray
    tree: Tree
    transforms: FloatArray
    occluder_of: IntArray

    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Error bounds and radii (m,) of the occluders, each in its own space."""
        raise NotImplementedError

    def errors(self) -> FloatArray:
        """(k, 2) the errors that drawing has to answer for, world units; infinite for none.

        Of far occluders how far they may stray.  Near ones have none: what they cover beside their
        triangles is held down to the overhang of the build, whatever they are seen from.
        """
        bounds = np.append(self._known()[0], np.inf)
        found = np.asarray(bounds[self.occluder_of] * self._stretch())
        found[self.occluder_of[:, NEAR] >= 0, NEAR] = 0.0
        return found

    def hiding_radii(self) -> FloatArray:
        """(k, 2) world units; 0 for none."""
        return np.asarray(np.append(self._known()[1], 0.0)[self.occluder_of] * self._stretch())

    def _stretch(self) -> FloatArray:
        """(k, 1) how much the transform of a leaf enlarges lengths, at most; 1 for inner nodes."""
        result = np.ones((len(self.tree), 1))
        leaves = np.nonzero(self.tree.is_leaf)[0]
        parts = self.tree.order[self.tree.spans[leaves, 0]]
        result[leaves, 0] = scales(self.transforms[parts])
        return result


@dataclass(frozen=True, eq=False)
class TreeOutline(NodeTree):
    """As :class:`OccluderTree`, without the triangles of the occluders.

    ``error_bounds``, ``radii``  (m,) float64 of the occluders, each in its own space.
    """

    error_bounds: FloatArray
    radii: FloatArray

    def _known(self) -> tuple[FloatArray, FloatArray]:
        return self.error_bounds, self.radii


@dataclass(frozen=True, eq=False)
class OccluderTree(NodeTree):
    """What a renderer needs at run time: the nodes of a :class:`NodeTree`, and their occluders.

    ``occluders``    shared by the instances of a mesh.
    ``radii``        of the disc that hides as much as each occluder; see ``hiding_radius``.
    """

    occluders: tuple[Occluder, ...]
    radii: FloatArray

    def __repr__(self) -> str:
        nodes, occluders = (
            count(len(self.occluder_of), "node"),
            count(len(self.occluders), "occluder"),
        )
        return f"<OccluderTree: {count(len(self.objects), 'object')}, {nodes}, {occluders}>"

    def _known(self) -> tuple[FloatArray, FloatArray]:
        bounds = np.array([occluder.error_bound for occluder in self.occluders], dtype=np.float64)
        return bounds, self.radii

    def part_of(self, leaf: int) -> int:
        """What a leaf holds."""
        return int(self.tree.order[self.tree.spans[leaf, 0]])

    def placed(self, node: int, level: int) -> tuple[FloatArray, IntArray, float]:
        """Vertices (n, 3), faces (m, 3) and error of one of its occluders, world units.

        The error is what drawing has to answer for, as in :meth:`errors`.
        """
        occluder = self.occluders[self.occluder_of[node, level]]
        points, error = occluder.vertices, occluder.error_bound if level == FAR else 0.0
        if self.tree.children[node, 1] == 0:
            transform = self.transforms[self.part_of(node)]
            points = points @ transform[:3, :3].T + transform[:3, 3]
            error *= float(scales(transform[None])[0])
        return points, occluder.faces, error

    def triangle_counts(self) -> NDArray[np.int64]:
        """(k, 2) of the occluders; 0 for none."""
        counts = np.array([*(len(occluder.faces) for occluder in self.occluders), 0])
        return np.asarray(counts[self.occluder_of])


def leaf_occluders(tree: OccluderTree) -> Scene:
    """The leaves' occluders where they stand, near ones if there are, for looking at.

    Raises :class:`~simplifier.errors.EmptyMeshError` where no leaf has one.
    """
    leaves = np.nonzero(tree.tree.is_leaf & (tree.occluder_of >= 0).any(axis=1))[0]
    if len(leaves) == 0:
        raise EmptyMeshError(
            "no object has an occluder", remedy="see in scene.json what each of them lacks"
        )
    near = tree.occluder_of[leaves, NEAR]
    shown = np.where(near >= 0, near, tree.occluder_of[leaves, FAR])
    used, mesh_of = np.unique(shown, return_inverse=True)
    parts = tree.tree.order[tree.tree.spans[leaves, 0]]
    return Scene(
        tuple(TriangleMesh(one.vertices, one.faces) for one in (tree.occluders[i] for i in used)),
        tuple(f"{tree.objects[tree.object_of[part]]}/{part}" for part in parts),
        mesh_of.astype(np.int32),
        tree.transforms[parts],
    )
