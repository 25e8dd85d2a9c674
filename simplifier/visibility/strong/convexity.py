"""Mesh -> whether it is the surface of something convex, and its faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray, IntArray
from simplifier.visibility.solid.object_heights import border_of

_DENT = 1e-3  # of the size: how deep faces may lie below the hull, by which it is then shrunk
_SAME = 1e-11  # of the size: faces of a hull that lie in one plane
_VOLUME = 0.01  # share by which volumes of shape and hull may differ
_MOST = 20_000_000  # faces times planes
_MOST_PLANES = 1000

OPEN, CLOSED = -1, -2


@dataclass(frozen=True, eq=False)
class Convexity:
    """The planes of a convex mesh by three of its vertices each, which outlast a transform.

    ``planes``  (p, 3) int64 vertices.
    ``within``  (3,) float64: a point inside.
    ``dent``    how deep the surface lies below the planes at most, in the mesh's units.
    ``base``    the plane in which the mesh is open, or :data:`CLOSED`.
    ``volume``  of the hull.
    """

    planes: NDArray[np.int64]
    within: FloatArray
    dent: float
    base: int
    volume: float


def convexity_of(points: FloatArray, faces: IntArray) -> Convexity | None:
    """None for what is not convex, or is open at more than one of its flat sides."""
    # Imported where it is used: it takes a fifth of the start of a program that needs no hulls.
    from scipy.spatial import ConvexHull, QhullError

    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    if size <= 0.0:
        return None
    vertices = (points - low) / size
    try:
        hull = ConvexHull(vertices[np.unique(faces)])
    except (QhullError, ValueError):
        return None
    corners = np.unique(faces)[hull.simplices]
    within = vertices[np.unique(faces)[hull.vertices]].mean(axis=0)
    corners, planes = _distinct(vertices, corners, within)
    if len(planes) > _MOST_PLANES or len(planes) * len(faces) > _MOST:
        return None
    depth = planes[:, 3] - vertices @ planes[:, :3].T  # (v, p)
    face_depth = depth[faces].max(axis=1).min(axis=1)
    dent = float(face_depth.max())
    border = np.unique(border_of(vertices, faces).ravel())
    base = CLOSED
    if len(border):
        base = int(np.argmin(depth[border].max(axis=0)))
        dent = max(dent, float(depth[border, base].max()))
    start = within if base == CLOSED else vertices[border[0]]
    a, b, c = (vertices[faces[:, corner]] - start for corner in range(3))
    volume = abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
    if dent > _DENT or abs(volume - hull.volume) > _VOLUME * hull.volume:
        return None
    return Convexity(
        corners, low + size * within, size * (dent + _SAME), base, float(hull.volume) * size**3
    )


def _distinct(
    vertices: FloatArray, corners: NDArray[np.int64], within: FloatArray
) -> tuple[NDArray[np.int64], FloatArray]:
    """The triangles of a hull, one of each plane, with these planes (p, 4)."""
    planes, areas = planes_through(vertices[corners], within)
    kept: list[int] = []
    left = np.argsort(-areas, kind="stable")
    left = left[areas[left] > 1e-14]
    while len(left):
        first = int(left[0])
        kept.append(first)
        gap = np.abs(planes[first, 3] - vertices[corners[left]] @ planes[first, :3]).max(axis=1)
        left = left[1:][gap[1:] > _SAME]
        if len(kept) > _MOST_PLANES:
            break
    return corners[kept], planes[kept]


def planes_through(corners: FloatArray, within: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Planes (p, 4) through three points each, (p, 3, 3), the point ``within`` inside, and areas.

    None of the three points is outside of its plane.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(lengths, 1e-300)[:, None]
    reach = np.einsum("pki,pi->pk", corners, normals)
    out = reach[:, 0] < normals @ within
    normals[out] *= -1.0
    reach[out] *= -1.0
    return np.column_stack([normals, reach.min(axis=1)]), 0.5 * lengths
