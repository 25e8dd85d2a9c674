"""Scene: many objects, of which some share a mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from simplifier.errors import printable
from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh
from simplifier.options.simplify import Axis
from simplifier.wording import count

_BATCH = 1 << 20  # points transformed at once
_MANY_POINTS = 1 << 25  # are transformed in the time in which what finds hulls is loaded
_WORTH_A_HULL = 64  # instances and vertices from which a convex hull costs less than it saves


@dataclass(frozen=True, eq=False)
class Scene:
    """Objects in world space; instances are objects of the same mesh.

    ``meshes``      each in its own space.
    ``names``       of the objects, each once.
    ``mesh_of``     (n,) int32: the mesh of each object.
    ``transforms``  (n, 4, 4) float64: from the mesh's space to the world, column vectors, affine;
                    invertible, though they may mirror.
    ``warnings``    what was left out and why, each naming its object, on one printable line.
    ``see_through`` triangles of objects that were left out, since one can see through them.
    """

    meshes: tuple[TriangleMesh, ...]
    names: tuple[str, ...]
    mesh_of: IntArray
    transforms: FloatArray
    warnings: tuple[str, ...] = ()
    see_through: int = 0

    @classmethod
    def of(cls, mesh: TriangleMesh) -> Scene:
        """A mesh as the only object, where it is."""
        return cls((mesh,), ("mesh",), np.zeros(1, dtype=np.int32), np.eye(4)[None])

    def __repr__(self) -> str:
        return f"<Scene: {count(len(self.names), 'object')} of {len(self.meshes):,} meshes>"

    def __post_init__(self) -> None:
        self.mesh_of.setflags(write=False)
        self.transforms.setflags(write=False)
        object.__setattr__(self, "warnings", tuple(map(printable, self.warnings)))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def triangle_counts(self) -> NDArray[np.int64]:
        """(n,) triangles of each object."""
        counts = np.array([len(mesh.faces) for mesh in self.meshes], dtype=np.int64)
        return counts[self.mesh_of]

    def bounds(self) -> FloatArray:
        """(n, 2, 3) lowest and highest corner of each object's box, world units.

        The boxes hold the transformed triangles tightly, to rounding: in a scene of very many, what
        is transformed of a mesh is its convex hull.
        """
        return self._bounds.copy()

    @cached_property
    def _bounds(self) -> FloatArray:
        result = np.empty((len(self), 2, 3))
        instances = list(self._instances())
        many = sum(len(mesh.vertices) * len(objects) for mesh, objects in instances) > _MANY_POINTS
        for mesh, objects in instances:
            points = mesh.vertices
            if many and min(len(objects), len(points)) >= _WORTH_A_HULL:
                points = points[mesh.extreme]
            step = max(1, _BATCH // len(points))
            for begin in range(0, len(objects), step):
                some = objects[begin : begin + step]
                # Points last: reductions along the short axis would take ten times as long.
                moved = self.transforms[some, :3, :3] @ points.T
                result[some, 0], result[some, 1] = moved.min(axis=2), moved.max(axis=2)
        return np.asarray(result + self.transforms[:, None, :3, 3])

    def some(self, kept: NDArray[np.bool_]) -> Scene:
        """The objects of a mask (n,); meshes that none of them has stay."""
        names = tuple(name for name, keep in zip(self.names, kept, strict=True) if keep)
        return replace(
            self, names=names, mesh_of=self.mesh_of[kept], transforms=self.transforms[kept]
        )

    def joined(self, objects: Sequence[int] | IntArray) -> TriangleMesh:
        """The triangles of one or more objects as one soup, world units, in the order given."""
        vertices, faces, count = [], [], 0
        for index in objects:
            mesh = self.meshes[self.mesh_of[index]]
            transform = self.transforms[index]
            vertices.append(mesh.vertices @ transform[:3, :3].T + transform[:3, 3])
            faces.append(mesh.faces + np.int32(count))
            count += len(mesh.vertices)
        return TriangleMesh(np.concatenate(vertices), np.concatenate(faces))

    def _instances(self) -> Iterator[tuple[TriangleMesh, NDArray[np.int64]]]:
        """Each mesh that is used with its objects, ascending."""
        by_mesh = np.argsort(self.mesh_of, kind="stable")
        starts = np.nonzero(np.diff(self.mesh_of[by_mesh], prepend=-1))[0]
        for objects in np.split(by_mesh, starts[1:]) if len(by_mesh) else ():
            yield self.meshes[self.mesh_of[objects[0]]], objects


NOTHING, WHOLE = -1, -2
"""In place of an object's opaque part: there is none, and it is all of the object."""


def opaque_places(scene: Scene, opaque: Scene) -> NDArray[np.int64]:
    """(n,) which object of ``opaque`` is the opaque part of each one of ``scene``, by their names;
    :data:`NOTHING` and :data:`WHOLE` where that is none or all of it.
    """
    if opaque is scene:
        return np.full(len(scene), WHOLE, dtype=np.int64)
    places = {name: place for place, name in enumerate(opaque.names)}
    found = np.array([places.get(name, NOTHING) for name in scene.names], dtype=np.int64)
    solid = np.append(opaque.triangle_counts, 0)[found]
    return np.where((found != NOTHING) & (solid == scene.triangle_counts), WHOLE, found)


def axis_order(up: Axis) -> NDArray[np.int64]:
    """(3,) which world axes are x, y and z of an upright space: a rotation."""
    axis = "xyz".index(up)
    return np.array([(axis + 1) % 3, (axis + 2) % 3, axis], dtype=np.int64)


def scales(transforms: FloatArray) -> FloatArray:
    """(n,) the largest factor by which each transform (n, 4, 4) stretches a length."""
    return np.asarray(np.linalg.norm(transforms[:, :3, :3], ord=2, axis=(1, 2)))
