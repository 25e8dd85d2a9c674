"""Objects as a file states them, before any is checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

RawMesh = tuple[FloatArray, NDArray[np.int64]]
"""Vertices (n, 3) float64 and faces (m, 3) of a file, either possibly empty or wrong."""


@dataclass(frozen=True, eq=False)
class Objects:
    """Meshes and where they stand; nothing is promised but the shapes.

    ``names``       one an object, possibly repeated.
    ``meshes``      as read, each in its own space.
    ``mesh_of``     (n,) int64, places in ``meshes``.
    ``transforms``  (n, 4, 4) float64, from the mesh's space to the world (column vectors).
    ``see_through``  how many triangles of each mesh were left out for that.
    ``occluders``   (n,) bool, which are occluders already, that viewers do not see.
    """

    names: list[str]
    meshes: list[RawMesh]
    mesh_of: NDArray[np.int64]
    transforms: FloatArray
    see_through: list[int]
    occluders: NDArray[np.bool_]

    @classmethod
    def one(cls, name: str, mesh: RawMesh, see_through: int = 0) -> Objects:
        """A single object that stands where its mesh says."""
        return cls(
            [name], [mesh], np.zeros(1, dtype=np.int64), np.eye(4)[None], [see_through],
            np.zeros(1, dtype=np.bool_),
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Objects]) -> Objects:
        """All objects, in order."""
        starts = np.cumsum([0, *(len(part.meshes) for part in parts)])
        places = [part.mesh_of + start for part, start in zip(parts, starts[:-1], strict=True)]
        return cls(
            [name for part in parts for name in part.names],
            [mesh for part in parts for mesh in part.meshes],
            np.concatenate([np.empty(0, dtype=np.int64), *places]),
            np.concatenate([np.empty((0, 4, 4)), *(part.transforms for part in parts)]),
            [count for part in parts for count in part.see_through],
            np.concatenate([np.empty(0, dtype=np.bool_), *(part.occluders for part in parts)]),
        )
