"""Join the loops of a polygon into one ring."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.planar import TOUCH, cross, magnitude

_SAME_SLOPE = 1e-12  # bridges less apart than this in slope run over the same points


@inner_kernel
def _rightmost(points, begin, end):
    """The row of largest x; of several the one of least y."""
    best = begin
    for index in range(begin + 1, end):
        x, y = points[index]
        if x > points[best, 0] or (x == points[best, 0] and y < points[best, 1]):
            best = index
    return best


@inner_kernel
def _edge_to_the_right(points, ring, count, x, y):
    """Place in the ring of the nearest edge that a ray from (x, y) along +x leaves through.

    The ring is counter-clockwise, so that edge goes upwards; of the two sides of a bridge it is
    the one that faces (x, y).
    """
    best, nearest = -1, np.inf
    for place in range(count):
        a = ring[place]
        b = ring[place + 1 if place + 1 < count else 0]
        if points[a, 1] <= y < points[b, 1]:
            t = (y - points[a, 1]) / (points[b, 1] - points[a, 1])
            hit = points[a, 0] + t * (points[b, 0] - points[a, 0])
            if x < hit < nearest:
                best, nearest = place, hit
    return best


@inner_kernel
def _visible_vertex(points, ring, count, edge, x, y, slack):
    """A row that (x, y) sees: the end of the hit edge with larger x, unless others are in between.

    In between are the vertices in the triangle of (x, y), the point hit and that end; the one of
    least slope against the ray, and of those the nearest, is then seen.
    """
    a = ring[edge]
    b = ring[edge + 1 if edge + 1 < count else 0]
    best = a if points[a, 0] > points[b, 0] else b
    rise = points[best, 1] - y
    side = 1.0 if rise >= 0.0 else -1.0
    run = points[best, 0] - x
    slope = abs(rise) / run
    near = slack * np.hypot(points[b, 0] - points[a, 0], points[b, 1] - points[a, 1])
    for place in range(count):
        w = ring[place]
        dx, dy = points[w, 0] - x, (points[w, 1] - y) * side
        if dx <= 0.0 or dy < 0.0 or dy > dx * (slope + _SAME_SLOPE):
            continue
        left = cross(
            points[a, 0], points[a, 1], points[b, 0], points[b, 1], points[w, 0], points[w, 1]
        )
        if left >= -near and (dy / dx < slope - _SAME_SLOPE or dx < run):
            best, slope, run = w, min(slope, dy / dx), dx
    return best


@inner_kernel
def _place_facing(points, ring, count, vertex, x, y):
    """The visit of the ring to a vertex from whose interior angle (x, y) is seen.

    Bridges that end at one vertex visit it several times, and their angles are disjoint.
    """
    best = -1
    for place in range(count):
        c = ring[place]
        if points[c, 0] != points[vertex, 0] or points[c, 1] != points[vertex, 1]:
            continue
        p = ring[place - 1 if place > 0 else count - 1]
        q = ring[place + 1 if place + 1 < count else 0]
        cx, cy, px, py = points[c, 0], points[c, 1], points[p, 0], points[p, 1]
        qx, qy = points[q, 0], points[q, 1]
        before = cross(px, py, cx, cy, x, y) > 0.0
        after = cross(cx, cy, qx, qy, x, y) > 0.0
        convex = cross(px, py, cx, cy, qx, qy) > 0.0
        if (convex and before and after) or (not convex and (before or after)):
            return place
        if best < 0:
            best = place
    return best


@kernel("float64[:, :], int64[:]")
def bridge_loops(points, starts):
    """One weakly simple ring of all loops.

    ``points`` (n, 2) float64, the counter-clockwise outer loop first, then clockwise holes, all
    apart; ``starts`` (loops + 1,) int64.  Returns (n + 2 * holes, 2) float64.
    """
    holes = len(starts) - 2
    slack = TOUCH * magnitude(points)
    ring = np.empty(len(points) + 2 * holes, np.int64)
    count = starts[1]
    ring[:count] = np.arange(count)
    begins = np.empty(holes, np.int64)
    rank = np.empty(holes, np.float64)
    for hole in range(holes):
        begins[hole] = _rightmost(points, starts[hole + 1], starts[hole + 2])
        rank[hole] = -points[begins[hole], 0]
    # From right to left: a bridge goes to the right, so it meets only loops already joined.
    order = np.argsort(rank, kind="mergesort")
    for hole in order:
        begin, end, start = starts[hole + 1], starts[hole + 2], begins[hole]
        x, y = points[start]
        edge = _edge_to_the_right(points, ring, count, x, y)
        if edge < 0:
            continue  # a hole outside the outer loop: not a valid polygon
        vertex = _visible_vertex(points, ring, count, edge, x, y, slack)
        place = _place_facing(points, ring, count, vertex, x, y)
        size = end - begin
        for index in range(count - 1, place, -1):
            ring[index + size + 2] = ring[index]
        for index in range(size + 1):
            ring[place + 1 + index] = begin + (start - begin + index) % size
        ring[place + size + 2] = ring[place]
        count += size + 2
    return points[ring[:count]]
