"""Plans of what stands on the ground -> triangles of the free space between them, bounded in size.

Wonka et al., "Visibility Preprocessing with Occluder Fusion for Urban Walkthroughs" (2000), section
3: a constrained Delaunay triangulation, "modified to guarantee that the maximum length of view cell
edges does not exceed a user specified threshold".  Here points are added in the middle of edges
that are too long until there are none, as in Delaunay refinement.  So triangles stay round where
there is room, and walls are divided no finer than their edges have to be.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import Delaunay, KDTree

from simplifier.geometry.mesh import FloatArray
from simplifier.geometry.view_cells import signed_areas

_AWAY = 0.01  # of the longest edge: cells keep away from walls by half as much to one and a half
_WALL = 0.8  # of the longest edge: pieces of walls; edges across to the other side are longer
_APART = 0.5  # of the longest edge: points that are added at once
_LEAST = 0.4  # of the longest edge: points that are added keep so far from those that there are
_THIN = 1e-3  # of the longest edge: thinner triangles are left out
_ROUNDS = 64
_BOUND = 1.0 - 1e-5  # of the longest edge: what is left for rounding to float32

Indices = NDArray[np.int64]


def free_space(
    low: FloatArray, high: FloatArray, obstacles: list[shapely.Geometry], longest: float
) -> shapely.Geometry:
    """The rectangle from ``low`` to ``high`` (2,) without the obstacles.

    It keeps away from them by a hundredth of the ``longest`` edge, more or less half of it: what is
    narrower than twice that is no way, and no rounding moves a cell into a wall.  Outlines are
    simplified within that distance.
    """
    around = shapely.box(*low, *high)
    if not obstacles:
        return around
    away = _AWAY * longest
    solid = shapely.union_all(obstacles).buffer(away, join_style="mitre").simplify(0.5 * away)
    free: shapely.Geometry = around.difference(solid)
    return free


def triangles_of(region: shapely.Geometry, longest: float) -> FloatArray:
    """(n, 3, 2) counter-clockwise triangles that fill a region, none with an edge over ``longest``.

    Where they are thinner than a thousandth of that there are none.
    """
    bound = _BOUND * longest
    lines = shapely.segmentize(region.boundary, _WALL * bound)
    walls = _segments(lines)
    points = np.unique(walls.reshape(-1, 2), axis=0)
    if len(points) < 3:
        return np.empty((0, 3, 2))
    shapely.prepare(region)
    made = Delaunay(points)
    for _ in range(_ROUNDS):
        more = _between(made, region, bound)
        if len(more) == 0:
            break
        points = np.concatenate([points, more])
        made = Delaunay(points)
    kept = _bounded(_constrained(points, made, walls, region), bound)
    area = signed_areas(kept)
    kept = np.where((area < 0.0)[:, None, None], kept[:, ::-1], kept)
    height = 2.0 * np.abs(area) / np.maximum(_lengths(kept).max(axis=1), 1e-300)
    return np.ascontiguousarray(kept[height > _THIN * longest])


def _segments(lines: shapely.Geometry) -> FloatArray:
    """(k, 2, 2) from each point of lines to the next."""
    points, line = shapely.get_coordinates(shapely.get_parts(lines), return_index=True)
    same = line[1:] == line[:-1]
    return np.stack([points[:-1][same], points[1:][same]], axis=1)


def _edges(simplices: NDArray[np.int32]) -> Indices:
    """(k, 2) the edges of triangles, each once, the lower point first."""
    pairs = np.sort(simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.unique(pairs, axis=0).astype(np.int64)


def _between(made: Delaunay, region: shapely.Geometry, bound: float) -> FloatArray:
    """(k, 2) middles of edges that are too long, the longest first, far enough from each other."""
    points = made.points
    edges = points[_edges(made.simplices)]
    length = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    order = np.argsort(-length, kind="stable")
    order = order[length[order] > bound]
    middles = np.asarray(edges[order].mean(axis=1))
    middles = middles[shapely.contains_xy(region, middles)]
    if len(middles) == 0:
        return np.asarray(middles)
    middles = middles[KDTree(points).query(middles)[0] >= _LEAST * bound]
    kept = np.ones(len(middles), dtype=np.bool_)
    near = KDTree(middles).query_pairs(_APART * bound, output_type="ndarray")
    for first, second in near[np.lexsort(near.T[::-1])]:
        if kept[first]:
            kept[second] = False
    return np.asarray(middles[kept])


def _constrained(
    points: FloatArray, made: Delaunay, walls: FloatArray, region: shapely.Geometry
) -> FloatArray:
    """(n, 3, 2) the triangles within the region; those that walls cross are made anew."""
    corners = points[made.simplices]
    inside = shapely.contains_xy(region, corners.mean(axis=1))
    known = {(int(a), int(b)) for a, b in _edges(made.simplices)}
    ends = KDTree(points).query(walls.reshape(-1, 2))[1].reshape(-1, 2)
    missing = np.array([(int(min(e)), int(max(e))) not in known for e in ends], dtype=np.bool_)
    if not missing.any():
        return np.asarray(corners[inside])
    tree = shapely.STRtree(shapely.linestrings(walls[missing]))
    crossed = np.unique(tree.query(shapely.polygons(corners), predicate="crosses")[0])
    inside[crossed] = False
    around = shapely.union_all(shapely.polygons(corners[crossed]))
    anew = shapely.constrained_delaunay_triangles(region.intersection(around))
    return np.concatenate([corners[inside], _triangles(anew)])


def _triangles(geometry: shapely.Geometry) -> FloatArray:
    parts = shapely.get_parts(geometry)
    return np.asarray(shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3])


def _bounded(triangles: FloatArray, bound: float) -> FloatArray:
    """Triangles in two across their longest edge, until none is too long."""
    done = []
    while len(triangles):
        lengths = _lengths(triangles)
        long = lengths.max(axis=1) > bound
        done.append(triangles[~long])
        turn = (np.argmax(lengths[long], axis=1)[:, None] + np.arange(3)) % 3
        begin, end, apex = np.take_along_axis(triangles[long], turn[:, :, None], 1).swapaxes(0, 1)
        middle = 0.5 * (begin + end)
        triangles = np.concatenate(
            [np.stack([begin, middle, apex], axis=1), np.stack([middle, end, apex], axis=1)]
        )
    return np.concatenate([np.empty((0, 3, 2)), *done])


def _lengths(triangles: FloatArray) -> FloatArray:
    """(n, 3) of the edges from each corner to the next."""
    return np.asarray(np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2))
