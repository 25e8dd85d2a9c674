"""What a point sees of a terrain of triangles: exact lines over its plan.

Along an azimuth the surface is a chain of straight pieces from one edge of the triangles to the
next, so the slope of lines to it is greatest where it crosses edges.  What is steeper than all
before is seen.  The terrain is solid below, at the borders of holes as well.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

_SHARE = 1e-6  # of slopes, by which one must be steeper than what rounding may make of it


@inline_kernel
def _height(heights, c, r, x, y):
    """Of the surface in a square that is split from its first post to its last."""
    u, v = x - c, y - r
    h00, h11 = heights[c, r], heights[c + 1, r + 1]
    if u >= v:
        h10 = heights[c + 1, r]
        return h00 + (h10 - h00) * u + (h11 - h10) * v
    h01 = heights[c, r + 1]
    return h00 + (h11 - h01) * u + (h01 - h00) * v


@inner_kernel
def _follow(eye, angle, heights, known, tiles_x, tiles_y, numbers, spacing, top, margin, found):
    """Walk along an azimuth and note in ``found`` which tiles come into view."""
    mx, my = known.shape
    x, y, z = eye[0] / spacing[0], eye[1] / spacing[1], eye[2]
    dx, dy = math.cos(angle) / spacing[0], math.sin(angle) / spacing[1]
    t, leave = 0.0, np.inf
    for axis in range(2):
        at, along, size = (x, dx, mx) if axis == 0 else (y, dy, my)
        if along != 0.0:
            one, other = -at / along, (size - at) / along
            t, leave = max(t, min(one, other)), min(leave, max(one, other))
        elif at < 0.0 or at > size:
            return
    if t >= leave:
        return
    c = min(max(np.int64(math.floor(x + t * dx)), 0), mx - 1)
    r = min(max(np.int64(math.floor(y + t * dy)), 0), my - 1)
    steepest = -np.inf
    while t < leave:
        if steepest >= 0.0 and top - z <= steepest * t:
            return
        next_x = (c + (dx > 0.0) - x) / dx if dx != 0.0 else np.inf
        next_y = (r + (dy > 0.0) - y) / dy if dy != 0.0 else np.inf
        end = min(next_x, next_y)
        if known[c, r] and end >= t:
            middle = end
            if dx != dy:
                across = ((y - r) - (x - c)) / (dx - dy)  # where it crosses the diagonal
                if t < across < end:
                    middle = across
            for place in range(3):
                at = t if place == 0 else middle if place == 1 else end
                height = _height(heights, c, r, x + at * dx, y + at * dy)
                if at <= margin:
                    if height >= z - margin:
                        return  # on the ground, or in it
                    continue
                slope = (height - z) / at
                steeper = margin / at + _SHARE * abs(slope)
                if steepest == -np.inf or slope - steepest > steeper + _SHARE * abs(steepest):
                    number = numbers[tiles_x[c], tiles_y[r]]
                    if np.isnan(found[number]):
                        found[number] = angle
                steepest = max(steepest, slope)
        t = max(t, end)
        if next_x < next_y:
            c += 1 if dx > 0.0 else -1
        else:
            r += 1 if dy > 0.0 else -1
        if c < 0 or c >= mx or r < 0 or r >= my:
            return


@kernel(
    "float64[:, :], int64, int64, float64[:], float64[:, :], float64[:, :], bool[:, :], "
    "int64[:], int64[:], int32[:, :], float64[:], float64, float64, float64[:, :]"
)
def see_terrain(
    eyes, begin, end, angles, goals, heights, known, tiles_x, tiles_y, numbers, spacing, top,
    margin, found,
):  # fmt: skip
    """Fill ``found`` of the eyes ``begin`` to ``end`` with azimuths along which tiles are seen.

    ``eyes``     (k, 3) float64, from the first post; ``angles`` (m,) float64 from x to y.
    ``goals``    (g, 2) float64: places that lines are aimed at as well.
    ``heights``  (mx, my) float64; ``known`` (mx - 1, my - 1) bool: the squares that are, split from
                 their first post to their last.
    ``tiles_x``, ``tiles_y``  (mx - 1,), (my - 1,) int64: the tile of a square; ``numbers`` int32
                 their objects.  ``spacing`` (2,) float64 between posts.
    ``top``      the highest post; ``margin`` a length: as much must be seen, and no tile is seen
                 from nearer.
    ``found``    (k, n) float64, NaN.
    """
    for view in range(begin, end):
        for angle in angles:
            _follow(
                eyes[view], angle, heights, known, tiles_x, tiles_y, numbers, spacing, top, margin,
                found[view],
            )  # fmt: skip
        for goal in goals:
            angle = math.atan2(goal[1] - eyes[view, 1], goal[0] - eyes[view, 0])
            _follow(
                eyes[view], angle, heights, known, tiles_x, tiles_y, numbers, spacing, top, margin,
                found[view],
            )  # fmt: skip
