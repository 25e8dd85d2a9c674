"""Polygons to triangles, for the formats whose faces have any number of corners.

A polygon is cut without adding vertices: triangles pass through, a fan is used where it lies inside
(always for a convex polygon), and ear clipping in the plane of the polygon's Newell normal does the
rest: by mapbox earcut, which mends what crosses itself at a cost that grows with the cube of the
corners, or for a polygon of many by a kernel whose work is bounded.

Triangle strips and fans as triangles.
"""

from __future__ import annotations

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from simplifier.errors import UnreadableMeshError
from simplifier.geometry.mesh import FloatArray, IndexArray

_MANY = 64
"""Corners from which the work is bounded: 64 that repeat take earcut a tenth of a millisecond."""

_LOOKS_A_CORNER = 2000
_LOOKS_OF_MANY = 10**8
_LOOKS_A_CORNER_OF_MANY = 100
"""Looks at other corners, to cut up a polygon of many.  An outline that does not wind within itself
takes ten a corner, whatever its length; one that does takes more the longer it is, and 100 million
are some seconds.
"""


def triangulate_polygons(
    points: FloatArray, sizes: IndexArray, corners: IndexArray, *, where: str
) -> IndexArray:
    """(m, 3) int64 faces, in the order and with the winding of the polygons.

    ``points`` (n, 3) float64; ``sizes`` (p,) int64 corner counts; ``corners`` (sum(sizes),) int64
    indices into ``points``.  Polygons of fewer than three corners give no triangle, others give
    ``size - 2``, or fewer when collinear corners are cut off without area.  Raises
    :class:`UnreadableMeshError` for a corner that is out of range.
    """
    return triangles_by_polygon(points, sizes, corners, where=where)[0]


def triangles_by_polygon(
    points: FloatArray, sizes: IndexArray, corners: IndexArray, *, where: str
) -> tuple[IndexArray, IndexArray]:
    """As :func:`triangulate_polygons`, and how many triangles (p,) each polygon gives."""
    starts = np.cumsum(sizes) - sizes
    _check_corners(len(points), starts, corners, where)
    if len(sizes) and (sizes == 3).all():
        return corners.reshape(-1, 3), np.ones(len(sizes), dtype=np.int64)
    counts = np.maximum(sizes - 2, 0)
    first = np.cumsum(counts) - counts
    faces = np.full((int(counts.sum()), 3), -1, dtype=np.int64)
    order = np.argsort(sizes, kind="stable")
    for group in np.split(order, np.nonzero(np.diff(sizes[order]))[0] + 1):
        size = int(sizes[group[0]]) if len(group) else 0
        if size < 3:
            continue
        polygons = corners[starts[group, None] + np.arange(size)]
        rows = first[group, None] + np.arange(size - 2)
        faces[rows] = _triangulate_equal(points, polygons)
    needed = faces[:, 0] >= 0
    sums = np.concatenate([[0], np.cumsum(needed)])
    return faces[needed], sums[first + counts] - sums[first]


def _check_corners(count: int, starts: IndexArray, corners: IndexArray, where: str) -> None:
    outside = np.nonzero((corners < 0) | (corners >= count))[0]
    if len(outside):
        face = int(np.searchsorted(starts, outside[0], side="right")) - 1
        raise UnreadableMeshError(
            f"face {face} names vertex {int(corners[outside[0]])} (counted from 0),"
            f" but there are {count} vertices",
            where=where,
            remedy="the file is damaged; export it again",
        )


def _triangulate_equal(points: FloatArray, polygons: IndexArray) -> IndexArray:
    """(p, k - 2, 3) faces for (p, k) polygons of equal size; -1 marks a triangle not needed."""
    faces = _fan(polygons)
    if polygons.shape[1] == 3:
        return faces
    inside = _fan_lies_inside(points[polygons])
    # A quadrilateral with a reflex corner is cut by its other diagonal, a fan from corner 1.
    rest = np.nonzero(~inside)[0]
    turned = np.roll(polygons[rest], -1, axis=1)
    faces[rest] = _fan(turned)
    rest = rest[~_fan_lies_inside(points[turned])]
    if polygons.shape[1] == 4:
        # A triangle written as a quadrilateral with a repeated corner; some exporters do only that.
        faces[rest] = _fan(polygons[rest])
        rest = rest[~_fan_lies_inside(points[polygons[rest]], strictly=False)]
    for index in rest.tolist():
        faces[index] = _clip_ears(points, polygons[index])
    return faces


def _fan(polygons: IndexArray) -> IndexArray:
    apex = np.repeat(polygons[:, :1], polygons.shape[1] - 2, axis=1)
    return np.stack([apex, polygons[:, 1:-1], polygons[:, 2:]], axis=2)


def _fan_lies_inside(corners: FloatArray, *, strictly: bool = True) -> NDArray[np.bool_]:
    """(p,): whether all triangles of the fan from corner 0 of (p, k, 3) polygons wind alike.

    For a simple polygon the corners are then sorted by angle around corner 0, so the fan covers it.
    Unless ``strictly``, triangles without area may be among them.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        spokes = corners[:, 1:] - corners[:, :1]
        size = np.abs(spokes).max(axis=(1, 2), keepdims=True)
        spokes = spokes / np.where(size > 0.0, size, 1.0)
        normals = np.cross(spokes[:, :-1], spokes[:, 1:])
        total = normals.sum(axis=1, keepdims=True)
        along = (normals * total).sum(axis=2)
        return np.asarray((along > 0.0 if strictly else along >= 0.0).all(axis=1))


def _clip_ears(points: FloatArray, polygon: IndexArray) -> IndexArray:
    """(k - 2, 3) faces of one polygon, unused rows -1; a fan when it has no area or no number."""
    fan: IndexArray = _fan(polygon[None])[0]
    flat = _project(points[polygon])
    if flat is None:
        return fan
    if len(flat) > _MANY:
        from simplifier.kernels.ears import clip_ears  # most files hold triangles alone

        faces = np.full_like(fan, -1)
        ears = np.empty_like(fan)
        places = np.unique(flat @ (1.0, 1.0j), return_inverse=True)[1]
        count = clip_ears(flat, places, _most_looks(len(flat)), ears)
        faces[:count] = polygon[ears[:count]]
        return faces
    ends = np.array([len(flat)], dtype=np.uint32)
    ears = mapbox_earcut.triangulate_float64(flat, ends).astype(np.int64).reshape(-1, 3)
    if not 0 < len(ears) <= len(fan):
        return fan
    a, b, c = (flat[ears[:, k]] for k in range(3))
    backwards = _cross(b - a, c - a) < 0.0
    ears[backwards] = ears[backwards][:, ::-1]
    faces = np.full_like(fan, -1)
    faces[: len(ears)] = polygon[ears]
    return faces


def _most_looks(corners: int) -> int:
    return min(_LOOKS_A_CORNER * corners, _LOOKS_OF_MANY + _LOOKS_A_CORNER_OF_MANY * corners)


def _project(corners: FloatArray) -> FloatArray | None:
    """(k, 2): the polygon seen along the axis nearest to its normal, counter-clockwise."""
    with np.errstate(invalid="ignore", over="ignore"):
        relative = corners - corners[0]
        scale = np.abs(relative).max()
        if not np.isfinite(scale) or scale == 0.0:
            return None
        relative = relative / scale
    normal = np.cross(relative, np.roll(relative, -1, axis=0)).sum(axis=0)
    axis = int(np.abs(normal).argmax())
    if normal[axis] == 0.0:
        return None
    u, v = (axis + 1) % 3, (axis + 2) % 3
    return np.ascontiguousarray(relative[:, [u, v] if normal[axis] > 0.0 else [v, u]])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def strip_triangles(indices: IndexArray) -> IndexArray:
    """(m, 3) from (k,): k - 2 triangles that all wind like the first one.

    Triangles with a repeated index are left out: they are the stitches that join strips.
    """
    count = max(len(indices) - 2, 0)
    triangles = indices[np.arange(count)[:, None] + np.arange(3)]
    triangles[1::2] = triangles[1::2, [1, 0, 2]]
    a, b, c = triangles.T
    return np.asarray(triangles[(a != b) & (b != c) & (c != a)])


def fan_triangles(indices: IndexArray) -> IndexArray:
    """(m, 3) from (k,): k - 2 triangles around the first index."""
    count = max(len(indices) - 2, 0)
    apex = np.full(count, indices[0] if count else 0, dtype=np.int64)
    return np.stack([apex, indices[1 : 1 + count], indices[2 : 2 + count]], axis=1)


def split_strips(sizes: IndexArray, items: IndexArray) -> IndexArray:
    """(m, 3) from lists of strips, as in PLY: -1 ends a strip inside a list."""
    ends = np.cumsum(sizes)[:-1]
    cuts = np.nonzero(items == -1)[0]
    pieces = np.split(items, np.unique(np.concatenate([ends, cuts])))
    triangles = [strip_triangles(piece[piece != -1]) for piece in pieces]
    return np.concatenate([np.empty((0, 3), dtype=np.int64), *triangles])
