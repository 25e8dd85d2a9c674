"""TriangleMesh: the triangle soup that everything starts from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.errors import EmptyMeshError, MeshError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]

_Scalar = TypeVar("_Scalar", np.float64, np.int32)

_BLOCK = 1 << 17  # triangles that are checked at once: about 30 MiB of corners, edges and products


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


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A triangle soup: no promise about closedness, winding, crossings or shared vertices.

    ``vertices``  (n, 3) float64, world units, finite, read-only.
    ``faces``     (m, 3) int32, m >= 1, indices into ``vertices``, read-only; the winding is that of
                  the input and no stage relies on it.
    ``dropped``   what :meth:`from_soup` left out.

    Build one with :meth:`from_soup`; the plain constructor trusts its arguments.
    """

    vertices: FloatArray
    faces: IntArray
    dropped: DroppedTriangles = field(default_factory=DroppedTriangles)

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
        points = np.atleast_2d(np.asarray(vertices, dtype=np.float64))
        indices = np.atleast_2d(np.asarray(faces, dtype=np.int64))
        if points.size == 0 or indices.size == 0:
            raise EmptyMeshError(
                "the mesh has no triangle", where=where, remedy="export it with faces"
            )
        _check_shapes(points, indices, where)
        usable, dropped = _usable_triangles(points, indices)
        if not usable.any():
            raise EmptyMeshError(
                f"none of the {len(indices)} triangles has a finite, non-zero area",
                where=where,
                remedy="check the export for NaN coordinates and collapsed faces",
            )
        return cls(*_of_used_vertices(points, indices, usable), dropped)

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
    if indices.min() >= 0 and indices.max() < len(points):
        return
    outside = (indices < 0) | (indices >= len(points))
    face = int(np.nonzero(outside.any(axis=1))[0][0])
    value = int(indices[face][outside[face]][0])
    raise MeshError(
        f"face {face} names vertex {value}, but there are {len(points)} vertices",
        where=where,
        remedy="repair the face indices",
    )


def _blocks(count: int) -> Iterator[slice]:
    """The range 0..count in pieces whose temporary arrays are small beside the mesh."""
    for begin in range(0, count, _BLOCK):
        yield slice(begin, min(begin + _BLOCK, count))


def _usable_triangles(
    points: FloatArray, indices: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], DroppedTriangles]:
    """(m,) which faces have a finite, non-zero area, and a count of the others."""
    usable = np.zeros(len(indices), dtype=np.bool_)
    dropped = DroppedTriangles()
    for block in _blocks(len(indices)):
        usable[block], some = _usable_block(points, indices[block])
        dropped += some
    return usable, dropped


def _usable_block(
    points: FloatArray, indices: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], DroppedTriangles]:
    corners = points[indices]
    # Beyond 1e150 squared lengths overflow float64; the usual 1e30 marker for "no value" is a
    # legal coordinate here and is judged by the voxelizer's scale, not by this test.
    finite = np.asarray((np.abs(corners) < 1e150).all(axis=(1, 2)))
    a, b, c = indices.T
    repeated = finite & ((a == b) | (b == c) | (c == a))
    usable = finite & ~repeated
    usable[usable] = have_area(corners[usable])
    non_finite, repeats = int(np.count_nonzero(~finite)), int(np.count_nonzero(repeated))
    flat = len(indices) - int(np.count_nonzero(usable)) - non_finite - repeats
    return usable, DroppedTriangles(non_finite, repeats, flat)


def _of_used_vertices(
    points: FloatArray, indices: NDArray[np.int64], usable: NDArray[np.bool_]
) -> tuple[FloatArray, IntArray]:
    """Copies: the vertices of the usable faces, and those faces by their new numbers."""
    used = np.zeros(len(points), dtype=np.bool_)
    for block in _blocks(len(indices)):
        used[indices[block][usable[block]]] = True
    renumbered = np.cumsum(used, dtype=np.int32)
    renumbered -= 1
    vertices, faces = _room_for(used, np.float64), _room_for(usable, np.int32)
    _fill(vertices, (points[block][used[block]] for block in _blocks(len(points))))
    _fill(faces, (renumbered[indices[block][usable[block]]] for block in _blocks(len(indices))))
    return vertices, faces


def _room_for(kept: NDArray[np.bool_], dtype: type[_Scalar]) -> NDArray[_Scalar]:
    return np.empty((int(np.count_nonzero(kept)), 3), dtype=dtype)


def _fill(whole: NDArray[_Scalar], parts: Iterable[NDArray[_Scalar]]) -> None:
    """Put the parts into ``whole`` one behind the other."""
    count = 0
    for part in parts:
        whole[count : count + len(part)] = part
        count += len(part)
