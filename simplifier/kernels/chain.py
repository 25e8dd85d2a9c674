"""Cut ears off a ring, the smallest first."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.planar import TOUCH, cross, magnitude

# A corner nearer to the line of its neighbours than this share of the largest coordinate lies on
# it: some fifty units in the last place, what rotating a straight ring can do to it.
_ON_LINE = 1e-14


@inner_kernel
def _doubled_area(ring, before, vertex, after, on_line):
    """Twice the signed area of a corner's triangle; zero when the corner is straight or a spike."""
    ax, ay = ring[before, 0], ring[before, 1]
    vx, vy = ring[vertex, 0], ring[vertex, 1]
    bx, by = ring[after, 0], ring[after, 1]
    area = cross(ax, ay, vx, vy, bx, by)
    longest = max(abs(vx - ax), abs(vy - ay), abs(bx - vx), abs(by - vy))
    return area if abs(area) > on_line * longest else 0.0


@inner_kernel
def _enters(ring, before, after, ax, ay, bx, by, near):
    """Whether one of two neighbours of a point on segment ab lies to the left of it."""
    return (
        cross(ax, ay, bx, by, ring[before, 0], ring[before, 1]) > near
        or cross(ax, ay, bx, by, ring[after, 0], ring[after, 1]) > near
    )


@inner_kernel
def _blocker(ring, following, before, vertex, after, slack):
    """A vertex of the ring in the triangle (before, vertex, after), or -1 when it is an ear.

    Those that coincide with a corner do not block.  The ring's visits to one point see disjoint
    angles, so an edge of another visit cannot enter the triangle there; an edge of ``before`` or
    ``after`` that did would have its other end in the triangle.  Nor does a vertex on the two edges
    of the ring, unless its own edges enter: it is the far side of a bridge, whose points on the
    near side, being straight, have gone.
    """
    ax, ay = ring[before, 0], ring[before, 1]
    vx, vy = ring[vertex, 0], ring[vertex, 1]
    bx, by = ring[after, 0], ring[after, 1]
    near_av = slack * np.sqrt((vx - ax) ** 2 + (vy - ay) ** 2)
    near_vb = slack * np.sqrt((bx - vx) ** 2 + (by - vy) ** 2)
    near_ba = slack * np.sqrt((ax - bx) ** 2 + (ay - by) ** 2)
    previous, other = after, following[after]
    while other != before:
        x, y = ring[other, 0], ring[other, 1]
        from_ba = cross(bx, by, ax, ay, x, y)
        if from_ba >= -near_ba:
            from_av = cross(ax, ay, vx, vy, x, y)
            from_vb = cross(vx, vy, bx, by, x, y)
            if (
                from_av >= -near_av
                and from_vb >= -near_vb
                and not ((x == ax and y == ay) or (x == bx and y == by) or (x == vx and y == vy))
            ):
                on = following[other]
                on_av, on_vb = from_av <= near_av, from_vb <= near_vb
                if (
                    from_ba <= near_ba
                    or not (on_av or on_vb)
                    or (on_av and _enters(ring, previous, on, ax, ay, vx, vy, near_av))
                    or (on_vb and _enters(ring, previous, on, vx, vy, bx, by, near_vb))
                ):
                    return other
        previous, other = other, following[other]
    return -1


@inner_kernel
def _smallest_ear(ring, preceding, following, areas, blockers, alive, start, slack):
    """The vertex whose ear has the least area, or -1; of equal ones the first from ``start``.

    A corner is tested only when it is the smallest left; what blocks it is remembered and blocks
    it as long as it is in the ring.
    """
    while True:
        best, least = -1, np.inf
        vertex = start
        while True:
            if 0.0 <= areas[vertex] < least and not (
                blockers[vertex] >= 0 and alive[blockers[vertex]]
            ):
                best, least = vertex, areas[vertex]
            vertex = following[vertex]
            if vertex == start:
                break
        if best < 0 or least == 0.0:
            return best
        blockers[best] = _blocker(ring, following, preceding[best], best, following[best], slack)
        if blockers[best] < 0:
            return best


@kernel("float64[:, :]")
def clip_ears(ring):
    """Cut the smallest ear off until a triangle is left.

    ``ring`` (n, 2) float64, n >= 3: counter-clockwise and weakly simple.  Returns ``ears``
    (n - 2, 3) int32 in the order of cutting: the neighbours that the middle vertex had when it
    went; the last row is the triangle that is left.  The last t rows triangulate the polygon with
    t triangles.  Corners that are straight, spikes or repeated go first: their rows have no area.

    Every ring of this kind has an ear (Meisters); only rounding can hide them all.  Then vertices
    that merely touch an ear are let pass, and if need be all: the chain always ends.
    """
    count = len(ring)
    scale = magnitude(ring)
    ears = np.empty((count - 2, 3), np.int32)
    following = np.arange(1, count + 1)
    following[count - 1] = 0
    preceding = np.arange(-1, count - 1)
    preceding[0] = count - 1
    alive = np.ones(count, np.bool_)
    areas = np.empty(count, np.float64)
    blockers = np.full(count, -1, np.int64)
    for vertex in range(count):
        areas[vertex] = _doubled_area(
            ring, preceding[vertex], vertex, following[vertex], _ON_LINE * scale
        )
    start = 0
    slacks = (TOUCH * scale, -TOUCH * scale, -np.inf)
    for step in range(count - 3):
        best = -1
        for slack in slacks:
            best = _smallest_ear(ring, preceding, following, areas, blockers, alive, start, slack)
            if best >= 0:
                break
            blockers[:] = -1
        if best < 0:
            best = start
        before, after = preceding[best], following[best]
        ears[step, 0], ears[step, 1], ears[step, 2] = before, best, after
        following[before] = after
        preceding[after] = before
        alive[best] = False
        blockers[before] = blockers[after] = -1
        areas[before] = _doubled_area(ring, preceding[before], before, after, _ON_LINE * scale)
        areas[after] = _doubled_area(ring, before, after, following[after], _ON_LINE * scale)
        if best == start:
            start = after
    ears[count - 3, 0], ears[count - 3, 1] = preceding[start], start
    ears[count - 3, 2] = following[start]
    return ears


@kernel("float64[:, :]")
def ear_levels(ring):
    """(n,) int32: the least number of triangles at which each vertex of ``ring`` (n, 2) is there,
    where ears go as :func:`clip_ears` cuts them."""
    ears = clip_ears(ring)
    lowest = np.ones(len(ring), np.int32)
    for step in range(len(ears)):
        lowest[ears[step, 1]] = len(ears) - step
    return lowest


@kernel("float64[:, :], uint32[:]")
def wind_triangles(ring, corners):
    """Triangles without area left out, the others wound counter-clockwise.

    ``corners`` (3 m,) uint32 rows of ``ring`` (n, 2) float64.  Returns (k, 3) int32 and the sum of
    their areas.
    """
    triangles = np.empty((len(corners) // 3, 3), np.int32)
    on_line = _ON_LINE * magnitude(ring)
    count, total = 0, 0.0
    for index in range(len(triangles)):
        a, b, c = corners[3 * index], corners[3 * index + 1], corners[3 * index + 2]
        area = _doubled_area(ring, a, b, c, on_line)
        if area != 0.0:
            triangles[count, 0] = a
            triangles[count, 1] = b if area > 0.0 else c
            triangles[count, 2] = c if area > 0.0 else b
            total += 0.5 * abs(area)
            count += 1
    return triangles[:count].copy(), total
