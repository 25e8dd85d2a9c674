"""RawMesh[] -> TriangleMesh[]: small meshes that have nothing to drop, checked together.

A scene has thousands of them, and a call of numpy takes longer than all sums in a hundred
triangles.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import (
    FURTHEST,
    FloatArray,
    IndexArray,
    TriangleMesh,
    have_area,
    in_all_columns,
    is_bounded,
    repeats_a_corner,
)

_SMALL = 1 << 11  # triangles, from which a mesh is as well checked by itself
_TOGETHER = 1 << 15  # triangles whose temporary arrays stay in a cache
_SPAN = FURTHEST / 8.0  # shortest triangles: a quarter of the box that could hold a stray

Soup = tuple[FloatArray, IndexArray]


def sound_meshes(soups: Sequence[Soup]) -> list[TriangleMesh | None]:
    """What :meth:`TriangleMesh.from_soup` makes of each, to the bit; None for one that is not
    small, or that it would refuse or drop something of.

    ``soups``  vertices (n, 3) and faces (m, 3) of each; of other shapes and types none is sound.
    """
    found: list[TriangleMesh | None] = [None] * len(soups)
    for places in _groups(soups):
        for place, mesh in zip(places, _checked([soups[p] for p in places]), strict=True):
            found[place] = mesh
    return found


def _groups(soups: Sequence[Soup]) -> Iterator[list[int]]:
    """Places of small meshes, some at a time."""
    places: list[int] = []
    triangles = 0
    for place, soup in enumerate(soups):
        if not _is_small(*soup):
            continue
        places.append(place)
        triangles += len(soup[1])
        if triangles > _TOGETHER:
            yield places
            places, triangles = [], 0
    if places:
        yield places


def _is_small(vertices: object, faces: object) -> bool:
    return (
        type(vertices) is np.ndarray
        and type(faces) is np.ndarray
        and vertices.dtype == np.float64
        and faces.dtype == np.int64
        and vertices.shape[1:] == faces.shape[1:] == (3,)
        and 0 < len(faces) <= _SMALL
        and 0 < len(vertices) <= 3 * _SMALL
    )


def _checked(soups: Sequence[Soup]) -> Iterator[TriangleMesh | None]:
    points = np.concatenate([vertices for vertices, _ in soups])
    corners = np.concatenate([faces for _, faces in soups])
    point_counts = np.array([len(vertices) for vertices, _ in soups])
    face_counts = np.array([len(faces) for _, faces in soups])
    first_point, first_face = (np.cumsum(n) - n for n in (point_counts, face_counts))

    most = np.repeat(point_counts, face_counts)[:, None]
    named = in_all_columns((corners >= 0) & (corners < most))
    bounded = is_bounded(points)
    # What is wrong stands at 0, where no sum overflows: its mesh is out already.
    safe = points.copy()
    safe[~bounded] = 0.0
    places = np.where(named[:, None], corners, 0) + np.repeat(first_point, face_counts)[:, None]
    triangles = safe[places]
    used = np.zeros(len(points), dtype=np.bool_)
    used[places] = True
    usable = named & ~repeats_a_corner(places) & have_area(triangles)
    sound = (
        np.logical_and.reduceat(bounded & used, first_point)
        & np.logical_and.reduceat(usable, first_face)
        & ~_may_stray(safe, triangles, first_point, first_face)
    )
    indices = corners.astype(np.int32)
    for good, point, points_end, face, faces_end in zip(
        sound.tolist(),
        first_point.tolist(), (first_point + point_counts).tolist(),
        first_face.tolist(), (first_face + face_counts).tolist(),
        strict=True,
    ):  # fmt: skip
        yield TriangleMesh(points[point:points_end], indices[face:faces_end]) if good else None


def _may_stray(
    points: FloatArray,
    triangles: FloatArray,
    first_point: NDArray[np.int64],
    first_face: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """(k,) whether one of a mesh's triangles might be a :attr:`Reach.stray`.

    None is where the box is not far longer than the shortest triangle: no corner is further from
    the middle than the box is long, and one of each triangle is away by half of its length.
    """
    low, high = (f.reduceat(points, first_point) for f in (np.minimum, np.maximum))
    a, b, c = triangles.transpose(1, 2, 0).copy()  # by column, since rows are short
    highest, lowest = np.maximum(np.maximum(a, b), c), np.minimum(np.minimum(a, b), c)
    lengths = (highest - lowest).max(axis=0)
    shortest = np.minimum.reduceat(lengths, first_face)
    return np.asarray((high - low).max(axis=1) > _SPAN * shortest)
