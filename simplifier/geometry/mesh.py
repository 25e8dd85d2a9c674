"""TriangleMesh: the triangle soup that everything starts from.

How far triangles reach out from the middle of their mesh; a few stray ones change nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simplifier.errors import EmptyMeshError
from simplifier.geometry.arrays import (
    check_arrays,
    face_array,
    vertex_array,
)
from simplifier.wording import count

FURTHEST = 2.0**24
"""Usual reaches.  A float32 that far out has no digit left for a length of the usual reach, so no
program that stores float32 can have meant such a triangle to be of the same mesh as the others."""

_ROWS = 1 << 14  # of three numbers: as many as a cache close to the processor holds


@dataclass(frozen=True, eq=False)
class Reach:
    """Distances are the largest along an axis, world units.

    ``middle``  (3,) the median of the vertices by axis.
    ``of``      (m,) from the middle to the furthest corner of each triangle; above 0 for one that
                has an area.
    """

    middle: NDArray[np.float64]
    of: NDArray[np.float64]

    @classmethod
    def measure(cls, vertices: NDArray[np.float64], faces: NDArray[np.signedinteger]) -> Reach:
        """``vertices`` (n, 3) finite, ``faces`` (m, 3), at least one of each."""
        middle = np.array([_median(column) for column in vertices.T])
        columns = list(zip(vertices.T, middle, strict=True))
        away = _highest(len(vertices), lambda some: [np.abs(c[some] - m) for c, m in columns])
        return cls(middle, _highest(len(faces), lambda some: np.take(away, faces[some]).T))

    @cached_property
    def usual(self) -> float:
        """Half of the triangles reach no further."""
        half = (len(self.of) - 1) // 2
        return float(np.partition(self.of, half)[half])

    @property
    def stray(self) -> NDArray[np.bool_]:
        """(m,) the triangles, less than half of them, that reach beyond all sense."""
        return np.asarray(self.of > FURTHEST * self.usual)


def _median(values: NDArray[np.float64]) -> float:
    """As numpy's, which looks for NaN as well: that takes longer than all else in a small mesh."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    low, high = np.partition(values, (half - 1, half))[half - 1 : half + 1].tolist()
    return float((low + high) / 2.0)


def _highest(
    count: int, numbers: Callable[[slice], Iterable[NDArray[np.float64]]]
) -> NDArray[np.float64]:
    """(count,) the highest of three ``numbers`` in each row; those of some rows at a time, which
    stay in a cache until they are read again."""
    found = np.empty(count)
    for some in _blocks(count, _ROWS):
        x, y, z = numbers(some)
        np.maximum(np.maximum(x, y), z, out=found[some])
    return found


FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
IndexArray = NDArray[np.int64]

A_MESH = "what simplifier.load or TriangleMesh.from_soup returns"
"""What to hand over where a mesh is asked for."""

_NO_FACES = np.empty((0, 3), dtype=np.int64)

_Scalar = TypeVar("_Scalar", np.float64, np.int32)

_FINITE = 1e100  # beyond, volumes overflow float64
_BLOCK = 1 << 17  # triangles that are checked at once: about 30 MiB of corners, edges and products


@dataclass(frozen=True)
class DroppedTriangles:
    """How many triangles of the input were left out, by reason.

    ``first``  by the same names: the number of the first one, from 0 in the order of the input.  A
               polygon counts as the triangles that it was cut into.
    """

    non_finite: int = 0  # a corner is NaN, infinite, or so far out that volumes overflow
    repeated_index: int = 0  # two corners are the same vertex
    zero_area: int = 0  # three corners on one line
    far_away: int = 0  # a corner is beyond what can be of the same mesh: see Reach.stray
    first: Mapping[str, int] = field(default_factory=dict, compare=False)

    @property
    def counts(self) -> dict[str, int]:
        """By reason, the names of the fields."""
        return {reason: getattr(self, reason) for reason in _REASONS}

    @property
    def total(self) -> int:
        return sum(self.counts.values())

    def __add__(self, other: DroppedTriangles) -> DroppedTriangles:
        """Of two inputs, so that no triangle is the first."""
        return DroppedTriangles(**(Counter(self.counts) + Counter(other.counts)), first={})

    def __str__(self) -> str:
        """For messages: "3 not finite (the first is triangle 12), 1 without area (…)"."""
        parts = []
        for reason, dropped in self.counts.items():
            place = f" (the first is triangle {self.first[reason]})" if reason in self.first else ""
            parts += [f"{dropped} {_REASONS[reason]}{place}"] if dropped else []
        return ", ".join(parts)


_REASONS = {
    "non_finite": "not finite",
    "repeated_index": "with a repeated corner",
    "zero_area": "without area",
    "far_away": f"over {FURTHEST:.0e} times as far out as half of the mesh",
}
_UNUSABLE = ("non_finite", "repeated_index", "zero_area")


@dataclass(frozen=True)
class Omitted:
    """Triangles of a file that were not taken: what they are called, why, and how many.

    ``see_through``  whether for that; else the user ignores them, or they are an occluder already.
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
    ``objects``   how many objects of a scene's file it is made of; 1 where the format has none.

    Build one with :meth:`from_soup`; the plain constructor trusts what its arrays hold.
    """

    vertices: FloatArray
    faces: IntArray
    dropped: DroppedTriangles = field(default_factory=DroppedTriangles)
    omitted: tuple[Omitted, ...] = ()
    objects: int = 1

    def __post_init__(self) -> None:
        check_arrays(self.vertices, self.faces, "build the mesh by TriangleMesh.from_soup")

    def __setstate__(self, state: Mapping[str, object]) -> None:
        self.__dict__.update(state)
        self.__post_init__()  # copies and pickles are not read-only

    def __repr__(self) -> str:
        triangles, vertices = count(len(self.faces), "triangle"), f"{len(self.vertices):,} vertices"
        return f"<TriangleMesh: {triangles}, {vertices}>"

    @classmethod
    def from_soup(cls, vertices: ArrayLike, faces: ArrayLike, *, where: str = "") -> TriangleMesh:
        """Copy arrays of any real dtype, check them, and drop the triangles that cannot be meant.

        ``vertices`` (n, 3), ``faces`` (m, 3).  Non-finite, repeated-index and zero-area triangles
        are dropped and counted, as are strays that would stretch the grid beyond all use (see
        ``docs/decisions/0012``); unused vertices are removed.  Raises :class:`MeshError` for what
        are no such arrays or indices out of range and :class:`EmptyMeshError` when no triangle is
        left.  ``where`` names the source in messages.
        """
        points = vertex_array(vertices, where)
        indices = face_array(faces, len(points), where) if len(points) else _NO_FACES
        if len(indices) == 0:
            raise EmptyMeshError(
                "the mesh has no triangle", where=where, remedy="export it with faces"
            )
        usable, unusable = _usable_triangles(points, indices)
        if not usable.any():
            raise EmptyMeshError(
                f"none of the {len(indices)} triangles has a finite, non-zero area",
                where=where,
                remedy="check the export for NaN coordinates and collapsed faces",
            )
        points, corners = _of_used_vertices(points, indices, usable)
        reach = Reach.measure(points, corners)
        if (stray := reach.stray).any():
            unusable["far_away"] = np.nonzero(usable)[0][stray]
            points, corners = _of_used_vertices(points, corners, ~stray)
            return cls(points, corners, _count_dropped(unusable))
        mesh = cls(points, corners, _count_dropped(unusable))
        mesh.__dict__["usual_reach"] = reach.usual  # known now; to find it again takes long
        return mesh

    @cached_property
    def bounds(self) -> FloatArray:
        """(2, 3) float64: lowest and highest corner of the bounding box, world units; read-only."""
        # By column: a reduction of (n, 3) along its long axis takes numpy ten times as long.
        columns = self.vertices.T
        found = np.array([[c.min() for c in columns], [c.max() for c in columns]])
        found.setflags(write=False)
        return found

    @cached_property
    def radius(self) -> float:
        """The largest distance of a vertex from the centre of the bounding box, world units."""
        low, high = self.bounds
        centre = low + (high - low) / 2.0
        # In units of the box, so that squares neither overflow nor vanish; by column, for speed.
        unit = float((high - low).max())
        squares = np.zeros(len(self.vertices))
        for axis in range(3):
            squares += ((self.vertices[:, axis] - centre[axis]) / unit) ** 2
        return float(np.sqrt(squares.max())) * unit

    @cached_property
    def usual_reach(self) -> float:
        """:attr:`Reach.usual` of its triangles, world units."""
        return Reach.measure(self.vertices, self.faces).usual

    @cached_property
    def extreme(self) -> IndexArray:
        """The vertices at the corners of the convex hull; all where they lie in a plane."""
        # Here, not above: that takes a fifth of the start of a program that needs no scenes.
        from scipy.spatial import ConvexHull, QhullError

        low, high = self.bounds
        # Qhull judges by the largest coordinate, which may be a map's.
        try:
            hull = ConvexHull((self.vertices - 0.5 * (low + high)) / (high - low).max())
        except QhullError:
            return np.arange(len(self.vertices))
        return np.asarray(hull.vertices, dtype=np.int64)

    @property
    def extent(self) -> FloatArray:
        """(3,) float64: edge lengths of the bounding box, world units."""
        low, high = self.bounds
        return np.asarray(high - low)


def as_mesh(triangles: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices (3 m, 3) and faces (m, 3) of ``triangles`` (m, 3, 3), none shared."""
    faces = np.arange(3 * len(triangles), dtype=np.int32).reshape(-1, 3)
    return triangles.reshape(-1, 3), faces


def is_bounded(points: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether each of ``points`` (n, 3) is finite and so near that no volume overflows."""
    return in_all_columns(np.abs(points) < _FINITE)


def in_all_columns(rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) of ``rows`` (n, 3), in a tenth of the time of ``all``, which is slow along so short an
    axis."""
    x, y, z = rows.T
    return np.asarray(x & y & z)


def repeats_a_corner(faces: IndexArray) -> NDArray[np.bool_]:
    """(m,) whether two corners of each of ``faces`` (m, 3) are the same vertex."""
    a, b, c = faces.T
    return np.asarray((a == b) | (b == c) | (c == a))


def have_area(triangles: FloatArray) -> NDArray[np.bool_]:
    """(m,) whether the corners of each of ``triangles`` (m, 3, 3) do not lie on one line."""
    found = np.empty(len(triangles), dtype=np.bool_)
    for some in _blocks(len(triangles), _ROWS):
        # By column, which takes a tenth of the time that rows of three take.
        a, b, c = triangles[some].transpose(1, 2, 0).copy()
        edges = np.stack([b - a, c - a])
        # Scaled by the longest edge, so that neither tiny nor huge meshes under- or overflow.
        scale = np.abs(edges).max(axis=(0, 1))
        scale[scale == 0.0] = 1.0
        edges /= scale
        (ux, uy, uz), (vx, vy, vz) = edges
        x, y, z = uy * vz != uz * vy, uz * vx != ux * vz, ux * vy != uy * vx
        found[some] = x | y | z
    return found


def _blocks(count: int, size: int = _BLOCK) -> Iterator[slice]:
    """The range 0..count in pieces whose temporary arrays are small beside the mesh."""
    for begin in range(0, count, size):
        yield slice(begin, min(begin + size, count))


def _usable_triangles(
    points: FloatArray, indices: IndexArray
) -> tuple[NDArray[np.bool_], dict[str, IndexArray]]:
    """(m,) which faces have a finite, non-zero area, and the numbers of the others by reason."""
    bounded = is_bounded(points)
    usable = np.zeros(len(indices), dtype=np.bool_)
    unusable: dict[str, list[IndexArray]] = {reason: [] for reason in _UNUSABLE}
    for block in _blocks(len(indices), _ROWS):
        some = indices[block]
        finite = in_all_columns(bounded.take(some))
        repeated = finite & repeats_a_corner(some)
        wide = finite & ~repeated
        wide[wide] = have_area(points.take(some if wide.all() else some[wide], axis=0))
        flat = finite & ~repeated & ~wide
        for reason, found in zip(_UNUSABLE, (~finite, repeated, flat), strict=True):
            unusable[reason].append(block.start + np.nonzero(found)[0])
        usable[block] = wide
    return usable, {reason: np.concatenate(found) for reason, found in unusable.items()}


def _of_used_vertices(
    points: FloatArray, indices: IndexArray | IntArray, usable: NDArray[np.bool_]
) -> tuple[FloatArray, IntArray]:
    """Copies: the vertices of the usable faces, and those faces by their new numbers."""
    used, whole = np.zeros(len(points), dtype=np.bool_), bool(usable.all())
    for block in _blocks(len(indices)):
        used[indices[block] if whole else indices[block][usable[block]]] = True
    if whole and used.all():
        return np.array(points, order="C"), indices.astype(np.int32, order="C")
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


def _count_dropped(places: Mapping[str, IndexArray]) -> DroppedTriangles:
    """Of the numbers of the triangles, ascending, by reason."""
    counts = {reason: len(found) for reason, found in places.items()}
    first = {reason: int(found[0]) for reason, found in places.items() if len(found)}
    return DroppedTriangles(**counts, first=first)
