"""Draw triangles into a room, one after the other and each by as little as that takes."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.slab import keep_between
from simplifier.kernels.soup_views import corner
from simplifier.kernels.voxelize import ROOM, is_contained

_TINY = 1e-300  # of a normal: less is none


@inner_kernel
def _shrink(triangle, share):
    """Take all corners (3, 3) that share of the way to their mean."""
    for axis in range(3):
        mean = (triangle[0, axis] + triangle[1, axis] + triangle[2, axis]) / 3.0
        for k in range(3):
            triangle[k, axis] += share * (mean - triangle[k, axis])


@inner_kernel
def _unit_normal(triangle):
    """A triple; 0 of a triangle without an area."""
    ax, ay, az = (
        triangle[1, 0] - triangle[0, 0],
        triangle[1, 1] - triangle[0, 1],
        triangle[1, 2] - triangle[0, 2],
    )
    bx, by, bz = (
        triangle[2, 0] - triangle[0, 0],
        triangle[2, 1] - triangle[0, 1],
        triangle[2, 2] - triangle[0, 2],
    )
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = max(np.sqrt(x * x + y * y + z * z), _TINY)
    return x / length, y / length, z / length


@kernel(f"float64[:, :, :], {ROOM}, float64[:], int64, float64, bool[:]")
def pull_triangles(triangles, room, steps, pulls, share, inside):
    """Draw each of ``triangles`` (m, 3, 3) in until it keeps to the ``room``, in place.

    It is tried with each of ``steps`` (s,) along its normal, then that ``share`` of the way smaller
    and again, up to ``pulls`` times.  ``inside`` (m,) bool is written: whether it keeps to the room
    in the end.
    """
    moved = np.empty((3, 3))
    slab = room[5]
    for index in range(len(triangles)):
        triangle = triangles[index]
        inside[index] = False
        for pull in range(pulls + 1):
            if pull > 0:
                _shrink(triangle, share)
            normal = _unit_normal(triangle)
            for step in steps:
                for k in range(3):
                    for axis in range(3):
                        moved[k, axis] = triangle[k, axis] + step * normal[axis]
                    keep_between(moved[k], slab)
                if is_contained(corner(moved, 0), corner(moved, 1), corner(moved, 2), room):
                    triangle[:] = moved
                    inside[index] = True
                    break
            if inside[index]:
                break
