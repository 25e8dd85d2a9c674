"""Meshes and where they stand: as one soup in the world, and as objects of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray
from simplifier.io.labels import Label, Labelled
from simplifier.io.objects import Objects, RawMesh

# Instances can multiply a small file beyond any memory.
MOST_VERTICES = MOST_TRIANGLES = 100_000_000

Size = tuple[int, int]
"""Vertices and triangles, neither counted beyond what is read at all."""


@dataclass(frozen=True)
class Material:
    """What a run of a mesh's triangles is made of; the name is empty without one."""

    name: str = ""
    see_through: bool = False


@dataclass(frozen=True, eq=False)
class NamedMesh:
    """A mesh in its own space, its faces in runs of one material each."""

    mesh: RawMesh
    runs: Sequence[tuple[Material, int]]


@dataclass(frozen=True, eq=False)
class Placed:
    """Meshes at places in the world, in the order of the file.

    ``meshes``      each once, however often it stands somewhere.
    ``mesh_of``     of every place, its mesh.
    ``transforms``  of every place, (4, 4) float64 from the mesh's space to the world.
    ``names``       of every place, what it is called, the first for messages.
    """

    meshes: Sequence[NamedMesh]
    mesh_of: Sequence[int]
    transforms: Sequence[FloatArray]
    names: Sequence[tuple[str, ...]]

    def labelled(self, where: str) -> Labelled:
        """All in one, in world coordinates."""
        meshes = {place: one.mesh for place, one in enumerate(self.meshes)}
        vertices, faces = place_instances(meshes, self.mesh_of, self._stacked(), where)
        labels, counts = [], []
        for names, mesh in zip(self.names, self.mesh_of, strict=True):
            for material, count in self.meshes[mesh].runs:
                labels.append(Label(names, material.name, material.see_through))
                counts.append(count)
        return Labelled(vertices, faces, labels, counts)

    def objects(self, see_through: bool) -> Objects:
        """An object for every place; ``see_through`` says whether such triangles are taken."""
        taken = [one.mesh if see_through else _opaque(one) for one in self.meshes]
        left_out = [
            len(one.mesh[1]) - len(mesh[1]) for one, mesh in zip(self.meshes, taken, strict=True)
        ]
        return Objects(
            [names[0] for names in self.names], taken, np.array(self.mesh_of, dtype=np.int64),
            self._stacked(), left_out, np.zeros(len(self.mesh_of), dtype=np.bool_),
        )  # fmt: skip

    def _stacked(self) -> FloatArray:
        return np.array(self.transforms, dtype=np.float64).reshape(-1, 4, 4)


def _opaque(one: NamedMesh) -> RawMesh:
    vertices, faces = one.mesh
    opaque = np.array([not material.see_through for material, _ in one.runs], dtype=np.bool_)
    return vertices, faces[np.repeat(opaque, [count for _, count in one.runs])]


def place_instances(
    meshes: Mapping[int, RawMesh], mesh_of: Sequence[int], transforms: FloatArray, where: str
) -> RawMesh:
    """Each mesh at each of its places, in their order: vertices and faces in world coordinates.

    Transforms are applied in float64; under a mirroring one the winding is turned.  Raises
    :class:`UnreadableMeshError` where the places add up to more than any memory holds.
    """
    _check_size(meshes, mesh_of, where)
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)]
    count = 0
    with np.errstate(invalid="ignore"):
        signs, _ = np.linalg.slogdet(transforms[:, :3, :3])  # a plain one overflows
    for mesh, transform, sign in zip(mesh_of, transforms, signs.tolist(), strict=True):
        points, triangles = meshes[mesh]
        if sign < 0.0:
            triangles = triangles[:, ::-1]
        vertices.append(_to_world(points, transform))
        faces.append(triangles + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def _check_size(meshes: Mapping[int, RawMesh], mesh_of: Sequence[int], where: str) -> None:
    vertices = sum(len(meshes[mesh][0]) for mesh in mesh_of)
    triangles = sum(len(meshes[mesh][1]) for mesh in mesh_of)
    if vertices > MOST_VERTICES or triangles > MOST_TRIANGLES:
        raise UnreadableMeshError(
            f"its {len(mesh_of)} instances add up to {triangles} triangles and {vertices}"
            f" vertices, more than {MOST_TRIANGLES}",
            where=where,
            remedy="split the scene",
        )


def _to_world(points: FloatArray, transform: FloatArray) -> FloatArray:
    linear, offset = transform[:3, :3], transform[:3, 3]
    with np.errstate(invalid="ignore", over="ignore"):
        if (linear == np.eye(3)).all():
            return np.asarray(points + offset)
        return np.asarray(points @ linear.T + offset)


def sum_sizes(sizes: Iterable[Size]) -> Size:
    """What they add up to, however often that is told: no number grows without end."""
    vertices = triangles = 0
    for more_vertices, more_triangles in sizes:
        vertices = min(vertices + more_vertices, MOST_VERTICES + 1)
        triangles = min(triangles + more_triangles, MOST_TRIANGLES + 1)
    return vertices, triangles
