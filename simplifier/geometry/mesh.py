"""TriangleMesh: the triangle soup that everything starts from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.errors import EmptyMeshError, MeshError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]


@dataclass(frozen=True)
class DroppedTriangles:
    """How many triangles of the input were left out, by reason."""

    non_finite: int = 0  # a corner is NaN, infinite, or so far out that areas overflow
    repeated_index: int = 0  # two corners are the same vertex
    zero_area: int = 0  # three corners on one line

    @property
    def total(self) -> int:
        return self.non_finite + self.repeated_index + self.zero_area

    def __add__(self, other: DroppedTriangles) -> DroppedTriangles:
        return DroppedTriangles(
            self.non_finite + other.non_finite,
            self.repeated_index + other.repeated_index,
            self.zero_area + other.zero_area,
        )


@dataclass(frozen=True)
class Omitted:
    """Triangles of a file that were not taken: what they are called, why, and how many.

    ``see_through``  whether for that; else the user ignores them.
    """

    name: str
    see_through: bool
    triangles: int


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle soup: no promise about closedness, winding, crossings or shared vertices.

    ``vertices``  (n, 3) float64, world units, finite, read-only.
    ``faces``     (m, 3) int32, m >= 1, indices into ``vertices``, read-only; the winding is that of
                  the input and no stage relies on it.
    ``dropped``   what :meth:`from_soup` left out.
    ``omitted``   what was not taken of a file.

    Build one with :meth:`from_soup`; the plain constructor trusts its arguments.
    """

    vertices: FloatArray
    faces: IntArray
    dropped: DroppedTriangles = field(default_factory=DroppedTriangles)
    omitted: tuple[Omitted, ...] = ()

    def __post_init__(self) -> None:
        self.vertices.setflags(write=False)
        self.faces.setflags(write=False)

    @classmethod
    def from_soup(cls, vertices: ArrayLike, faces: ArrayLike, *, where: str = "") -> TriangleMesh:
        """Copy arrays of any real dtype, check them, and drop the triangles that have no area.

        ``vertices`` (n, 3), ``faces`` (m, 3).  Non-finite, repeated-index and zero-area triangles
        are dropped and counted; unused vertices are removed (a far stray vertex must not stretch
        the grid).  Raises :class:`MeshError` for wrong shapes or indices out of range and
        :class:`EmptyMeshError` when no triangle is left.  ``where`` names the source in messages.
        """
        points = np.array(vertices, dtype=np.float64, ndmin=2)
        indices = np.array(faces, dtype=np.int64, ndmin=2)
        if points.size == 0 or indices.size == 0:
            raise EmptyMeshError(
                "the mesh has no triangle", where=where, remedy="export it with faces"
            )
        _check_shapes(points, indices, where)
        kept, dropped = _usable_triangles(points, indices)
        if len(kept) == 0:
            raise EmptyMeshError(
                f"none of the {len(indices)} triangles has a finite, non-zero area",
                where=where,
                remedy="check the export for NaN coordinates and collapsed faces",
            )
        used = np.zeros(len(points), dtype=np.bool_)
        used[kept] = True
        renumbered = np.cumsum(used, dtype=np.int32) - np.int32(1)
        return cls(points[used], np.ascontiguousarray(renumbered[kept]), dropped)

    @property
    def bounds(self) -> FloatArray:
        """(2, 3) float64: lowest and highest corner of the bounding box, world units."""
        # By column: a reduction of (n, 3) along its long axis takes numpy ten times as long.
        columns = self.vertices.T
        return np.array([[c.min() for c in columns], [c.max() for c in columns]])

    @property
    def extent(self) -> FloatArray:
        """(3,) float64: edge lengths of the bounding box, world units."""
        low, high = self.bounds
        return np.asarray(high - low)


def as_mesh(triangles: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices (3 m, 3) and faces (m, 3) of ``triangles`` (m, 3, 3), none shared."""
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    return triangles.reshape(-1, 3), faces


def have_area(triangles: FloatArray) -> NDArray[np.bool_]:
    """(m,) whether the corners of each of ``triangles`` (m, 3, 3) do not lie on one line."""
    edges = triangles[:, 1:] - triangles[:, :1]
    # Scaled by the longest edge, so that neither tiny nor huge meshes under- or overflow.
    scale = np.abs(edges).max(axis=(1, 2), keepdims=True, initial=0.0)
    scale[scale == 0.0] = 1.0
    edges /= scale
    return np.asarray((np.cross(edges[:, 0], edges[:, 1]) != 0.0).any(axis=1))


def _check_shapes(points: FloatArray, indices: NDArray[np.int64], where: str) -> None:
    if points.ndim != 2 or points.shape[1] != 3:
        raise MeshError(
            f"vertices have shape {points.shape}", where=where, remedy="pass an (n, 3) array"
        )
    if indices.ndim != 2 or indices.shape[1] != 3:
        raise MeshError(
            f"faces have shape {indices.shape}",
            where=where,
            remedy="pass an (m, 3) array of vertex indices",
        )
    outside = (indices < 0) | (indices >= len(points))
    if outside.any():
        face = int(np.nonzero(outside.any(axis=1))[0][0])
        value = int(indices[face][outside[face]][0])
        raise MeshError(
            f"face {face} names vertex {value}, but there are {len(points)} vertices",
            where=where,
            remedy="repair the face indices",
        )


def _usable_triangles(
    points: FloatArray, indices: NDArray[np.int64]
) -> tuple[NDArray[np.int64], DroppedTriangles]:
    """The faces with a finite, non-zero area, and a count of the others."""
    # Beyond 1e150 squared lengths overflow float64; the usual 1e30 marker for "no value" is a
    # legal coordinate here and is judged by the voxelizer's scale, not by this test.
    finite_vertex = np.asarray((np.abs(points) < 1e150).all(axis=1))
    finite = finite_vertex[indices].all(axis=1)
    a, b, c = indices.T
    repeated = finite & ((a == b) | (b == c) | (c == a))
    rest = np.nonzero(finite & ~repeated)[0]
    flat = ~have_area(points[indices[rest]])
    dropped = DroppedTriangles(
        non_finite=int(np.count_nonzero(~finite)),
        repeated_index=int(np.count_nonzero(repeated)),
        zero_area=int(np.count_nonzero(flat)),
    )
    return indices[rest[~flat]], dropped
