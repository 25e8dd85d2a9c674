"""Scene: many objects, of which some share a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray, TriangleMesh

_BATCH = 1 << 20  # points transformed at once


@dataclass(frozen=True, eq=False)
class Scene:
    """Objects in world space; instances are objects of the same mesh.

    ``meshes``      each in its own space.
    ``names``       of the objects, each once.
    ``mesh_of``     (n,) int32: the mesh of each object.
    ``transforms``  (n, 4, 4) float64: from the mesh's space to the world, column vectors, affine;
                    invertible, though they may mirror.
    ``warnings``    what was left out and why, each naming its object.
    """

    meshes: tuple[TriangleMesh, ...]
    names: tuple[str, ...]
    mesh_of: IntArray
    transforms: FloatArray
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.mesh_of.setflags(write=False)
        self.transforms.setflags(write=False)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def triangle_counts(self) -> NDArray[np.int64]:
        """(n,) triangles of each object."""
        counts = np.array([len(mesh.faces) for mesh in self.meshes], dtype=np.int64)
        return counts[self.mesh_of]

    def bounds(self) -> FloatArray:
        """(n, 2, 3) lowest and highest corner of each object's box, world units."""
        result = np.empty((len(self), 2, 3))
        for index, mesh in enumerate(self.meshes):
            objects = np.nonzero(self.mesh_of == index)[0]
            step = max(1, _BATCH // len(mesh.vertices))
            for begin in range(0, len(objects), step):
                some = objects[begin : begin + step]
                points = _moved(mesh.vertices, self.transforms[some])
                result[some, 0], result[some, 1] = points.min(axis=1), points.max(axis=1)
        return result

    def joined(self, objects: Sequence[int] | IntArray) -> TriangleMesh:
        """The triangles of some objects as one soup, world units, in the order given."""
        vertices, faces, count = [], [], 0
        for index in objects:
            mesh = self.meshes[self.mesh_of[index]]
            vertices.append(_moved(mesh.vertices, self.transforms[index : index + 1])[0])
            faces.append(mesh.faces + np.int32(count))
            count += len(mesh.vertices)
        return TriangleMesh(np.concatenate(vertices), np.concatenate(faces))


def scales(transforms: FloatArray) -> FloatArray:
    """(n,) the largest factor by which each transform (n, 4, 4) stretches a length."""
    return np.asarray(np.linalg.norm(transforms[:, :3, :3], ord=2, axis=(1, 2)))


def _moved(points: FloatArray, transforms: FloatArray) -> FloatArray:
    """(k, n, 3) of points (n, 3) under k transforms."""
    linear = transforms[:, :3, :3].transpose(0, 2, 1)
    return np.asarray(points @ linear + transforms[:, None, :3, 3])
