"""Move the corners of triangles that leave a room, one at a time, until they keep to it."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.voxelize import ROOM, is_contained

_PARTS = 7  # of an edge, between points of a triangle at which its depth is read
_DEEP = 1.5  # cells: points that are as deep as that are deep enough
_LEAST = 1e-9  # of squared cells, that a move has to bring
_WITHIN = 1e-6  # of a cell, that corners stay away from the border of the grid


@kernel(f"float64[:, :], int32[:, :], {ROOM}, float64[:, :, :], float64, float64[:], int64")
def fit(points, faces, room, depth, size, steps, turns):
    """Move ``points`` (n, 3) float64 of ``faces`` (m, 3) int32 to within the grid, and on.

    ``room``   as :func:`~simplifier.kernels.voxelize.is_contained` takes it.
    ``depth``  (nx, ny, nz) float64 at the centres of cells of a ``size`` in the points' units.
    ``steps``  (k,) float64, in the points' units; with each all corners take so many ``turns``.

    A corner of a face that is outside goes to either side along its normal and along each axis,
    where more of its faces are then inside, or as many and their points are deeper.
    """
    for point in points:
        _set_within(point, point, room)
    places, shallow = np.empty((len(faces), 3, 3)), np.empty(len(faces))
    inside = np.empty(len(faces), np.bool_)
    for face in range(len(faces)):
        for k in range(3):
            places[face, k] = points[faces[face, k]]
        inside[face] = _keeps_to(places[face], room)
        shallow[face] = _shallowness(places[face], depth, size)
    ends, around = _faces_around(len(points), faces)
    kept, less = np.empty(len(faces), np.bool_), np.empty(len(faces))
    ways = np.zeros((8, 3))
    for axis in range(3):
        ways[2 + 2 * axis, axis], ways[3 + 2 * axis, axis] = 1.0, -1.0
    for step in steps:
        for _ in range(turns):
            if inside.all():
                return
            for point in range(len(points)):
                star = around[ends[point] : ends[point + 1]]
                if inside[star].all():
                    continue
                _set_normal(places, star, ways)
                for way in ways:
                    _try_way(
                        points, point, step * way, faces, star, places, room, depth, size,
                        inside, shallow, kept, less,
                    )  # fmt: skip


@inner_kernel
def _faces_around(count, faces):
    """Of each point the faces that have it, one point after the other, and where those end."""
    ends = np.zeros(count + 1, np.int64)
    for face in range(len(faces)):
        for k in range(3):
            ends[faces[face, k] + 1] += 1
    ends = np.cumsum(ends)
    next_one = ends[:-1].copy()
    around = np.empty(3 * len(faces), np.int64)
    for face in range(len(faces)):
        for k in range(3):
            point = faces[face, k]
            around[next_one[point]] = face
            next_one[point] += 1
    return ends, around


@inner_kernel
def _set_normal(places, star, ways):
    """Fill the first two of the ``ways`` with the normal of faces around a corner, or zeros."""
    ways[:2] = 0.0
    for face in star:
        p, q, r = places[face, 0], places[face, 1], places[face, 2]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            ways[0, axis] += (q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i])
    length = np.sqrt(ways[0, 0] ** 2 + ways[0, 1] ** 2 + ways[0, 2] ** 2)
    if length > 0.0:
        for axis in range(3):
            ways[0, axis] /= length
            ways[1, axis] = -ways[0, axis]


@inner_kernel
def _try_way(
    points, point, by, faces, star, places, room, depth, size, inside, shallow, kept, less
):
    """Move one of the ``points`` there, unless the faces of its ``star`` are no better for it."""
    before = points[point, 0], points[point, 1], points[point, 2]
    _set_within(points[point] + by, points[point], room)
    now, then, was, gets = 0, 0, 0.0, 0.0
    for index in range(len(star)):
        face = star[index]
        for k in range(3):
            if faces[face, k] == point:
                places[face, k] = points[point]
        kept[index] = _keeps_to(places[face], room)
        less[index] = _shallowness(places[face], depth, size)
        now, then = now + inside[face], then + kept[index]
        was, gets = was + shallow[face], gets + less[index]
    if then > now or (then == now and gets < was - _LEAST):
        for index in range(len(star)):
            inside[star[index]], shallow[star[index]] = kept[index], less[index]
        return
    for axis in range(3):
        points[point, axis] = before[axis]
    for face in star:
        for k in range(3):
            if faces[face, k] == point:
                places[face, k] = points[point]


@inner_kernel
def _set_within(there, point, room):
    """Set the ``point`` (3,) to there, or the nearest place in the grid."""
    sizes = room[1].shape
    for axis in range(3):
        point[axis] = min(max(there[axis], _WITHIN), sizes[axis] - _WITHIN)


@inner_kernel
def _keeps_to(place, room):
    p, q, r = place[0], place[1], place[2]
    return is_contained((p[0], p[1], p[2]), (q[0], q[1], q[2]), (r[0], r[1], r[2]), room)


@inner_kernel
def _shallowness(place, depth, size):
    """Squares of what the points of a triangle, (3, 3), lack in depth, added up."""
    total = 0.0
    for i in range(_PARTS + 1):
        for j in range(_PARTS + 1 - i):
            u, v = i / _PARTS, j / _PARTS
            w = 1.0 - u - v
            x = np.int64((u * place[0, 0] + v * place[1, 0] + w * place[2, 0]) / size)
            y = np.int64((u * place[0, 1] + v * place[1, 1] + w * place[2, 1]) / size)
            z = np.int64((u * place[0, 2] + v * place[1, 2] + w * place[2, 2]) / size)
            x = min(max(x, 0), depth.shape[0] - 1)
            y = min(max(y, 0), depth.shape[1] - 1)
            z = min(max(z, 0), depth.shape[2] - 1)
            lack = _DEEP - depth[x, y, z]
            if lack > 0.0:
                total += lack * lack
    return total
