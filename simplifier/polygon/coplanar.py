"""Triangles -> fewer that cover the same points: those of one plane are merged.

Their union keeps no corner but its own, so a wall of ten thousand triangles becomes two.  Unlike a
section, whose loops are made of pixels, it may touch itself at any angle, so its holes are not
bridged.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from simplifier.geometry.mesh import FloatArray

if TYPE_CHECKING:
    import shapely

_AREA_ERROR = 1e-9
_MOST_NODED = 4000  # triangles that may overlap: their union takes a tenth of a second
_POLYGON = 3  # among the types of geometry
_GRID = 0.125  # of the tolerance: what corners are rounded to, so that edges meet


@dataclass(frozen=True, eq=False)
class PlaneGroup:
    """Triangles of one plane.

    ``which``    (k,) int64 of the triangles, the largest first.
    ``largest``  (3, 3) that one.
    ``normal``   (3,) its unit normal.
    """

    which: NDArray[np.int64]
    largest: FloatArray
    normal: FloatArray

    @property
    def origin(self) -> FloatArray:
        """(3,) a point of the plane."""
        return np.asarray(self.largest[0])

    @cached_property
    def axes(self) -> FloatArray:
        """(2, 3) orthonormal along it, counter-clockwise as the largest triangle is wound."""
        along = self.largest[1] - self.origin
        along = along / np.linalg.norm(along)
        return np.array([along, np.cross(self.normal, along)])


def group_by_plane(triangles: FloatArray, tolerance: float, most: int) -> list[PlaneGroup] | None:
    """Triangles (n, 3, 3), no corner further than ``tolerance`` from their plane.

    The planes are those of the largest triangles that fit no plane before.  None where more than
    ``most`` are needed, which is found out as soon as they are, or one that is left has no area.
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    left = np.argsort(-lengths, kind="stable")
    groups: list[PlaneGroup] = []
    while len(left):
        largest = left[0]
        if len(groups) == most or lengths[largest] == 0.0:
            return None
        origin, normal = triangles[largest, 0], normals[largest] / lengths[largest]
        on = (np.abs((triangles[left] - origin) @ normal) <= tolerance).all(axis=1)
        on[0] = True  # whatever rounding says of a sliver
        groups.append(PlaneGroup(left[on], triangles[largest], normal))
        left = left[~on]
    return groups


def merge_coplanar(
    triangles: FloatArray, groups: Sequence[PlaneGroup], tolerance: float, most: int
) -> FloatArray | None:
    """(m, 3, 3) triangles that cover what ``triangles`` (n, 3, 3) do, m at most ``most``.

    ``groups``  as :func:`group_by_plane` has them, each of which is merged by itself.  No point is
    further than twice the ``tolerance`` from one that was covered.  None where more are needed,
    where a part is thinner than that, or where it takes too long, as of thousands that overlap.
    """
    found: list[FloatArray] = []
    left, noded = most, len(triangles) <= _MOST_NODED
    for group in groups:
        corners = _flattened(triangles[group.which], group)
        merged = _merged(corners, tolerance, left, noded)
        if merged is None:
            return None
        left -= len(merged)
        found.append(group.origin + merged @ group.axes)
    return np.concatenate(found)


def _flattened(triangles: FloatArray, group: PlaneGroup) -> FloatArray:
    """(k, 3, 2) in the plane."""
    # By sums, not by a product of matrices: equal corners have to be equal to the bit.
    x, y, z = np.moveaxis(triangles - group.origin, -1, 0)
    return np.stack([u * x + v * y + w * z for u, v, w in group.axes], axis=-1)


def _merged(triangles: FloatArray, tolerance: float, most: int, noded: bool) -> FloatArray | None:
    """(m, 3, 2) of triangles (k, 3, 2), or None, as :func:`merge_coplanar`.

    ``noded``  whether they may overlap, or meet in part of an edge, which takes long to find out.
    """
    # Here, not above: it takes longer to load than a small occluder to make, and few meshes are
    # flat enough to need it.
    import shapely

    pieces = shapely.polygons(_once(triangles, _GRID * tolerance))
    union = _union_of_neighbours(pieces)
    if union is None and noded:
        with suppress(shapely.GEOSException):
            union = shapely.union_all(pieces, grid_size=_GRID * tolerance)
    parts = shapely.get_parts(union)
    found: list[FloatArray] = []
    # Normalized, a ring begins at a corner that is none by chance: the first one is always kept.
    for part in shapely.normalize(parts[shapely.get_type_id(parts) == _POLYGON]):
        rings = shapely.simplify(shapely.get_rings(part), tolerance, preserve_topology=False)
        outer, *holes = [shapely.get_coordinates(ring)[:-1] for ring in rings]
        if len(outer) < 3:
            return None
        corners = _cut([outer, *(hole for hole in holes if len(hole) >= 3)])
        lost = abs(_areas(corners).sum() - part.area)
        if len(corners) == 0 or lost > tolerance * part.length:
            return None
        found.append(corners)
        most -= len(corners)
        if most < 0:
            return None
    return np.concatenate(found) if found else None


def _cut(rings: Sequence[FloatArray]) -> FloatArray:
    """(m, 3, 2) triangles of a polygon, whose outer ring comes first, wound counter-clockwise."""
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    points = np.concatenate(rings)
    triangles = points[mapbox_earcut.triangulate_float64(points, ends)].reshape(-1, 3, 2)
    areas = _areas(triangles)
    triangles = np.where(areas[:, None, None] < 0.0, triangles[:, ::-1], triangles)
    return np.asarray(triangles[areas != 0.0])


def _union_of_neighbours(pieces: NDArray[np.object_]) -> shapely.Geometry | None:
    """Of triangles that meet in whole edges, in a hundredth of the time that others need; None of
    these."""
    import shapely

    area = float(shapely.area(pieces).sum())
    with suppress(shapely.GEOSException):  # the edges of what overlaps may form no rings
        union = shapely.coverage_union_all(pieces)
        if abs(union.area - area) <= _AREA_ERROR * area and union.is_valid:
            return union
    return None


def _once(triangles: FloatArray, grid: float) -> FloatArray:
    """(k, 3, 2) on a grid, those with an area there, each once however it is wound."""
    corners = np.round(triangles / grid) * grid
    corners = corners[_areas(corners) != 0.0]
    ranks = np.lexsort((corners[..., 1], corners[..., 0]), axis=-1)
    ordered = np.take_along_axis(corners, ranks[..., None], axis=1).reshape(-1, 6)
    _, first = np.unique(ordered, axis=0, return_index=True)
    return np.asarray(corners[np.sort(first)])


def _areas(triangles: FloatArray) -> FloatArray:
    """(k,) signed, of triangles (k, 3, 2)."""
    (ux, uy), (vx, vy) = (np.moveaxis(triangles[:, k] - triangles[:, 0], -1, 0) for k in (1, 2))
    return np.asarray(0.5 * (ux * vy - uy * vx))
