"""Cut ears off a polygon of many corners, with a bound on the work."""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

_WITHIN, _STRICTLY, _ANY = 0, 1, 2  # what a corner may not lie in, for an ear to be cut off


@inline_kernel
def _twice_area(points, a, b, c):
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])


@inline_kernel
def _cell(value, low, scale, across):
    return min(max(int((value - low) * scale), 0), across - 1)


@inner_kernel
def _blocked(
    points, places, a, b, c, heads, following, corner_at, reflex_at, across, low_x, low_y, scale,
    strictness
):  # fmt: skip
    """Whether a reflex corner lies in the ear (a, b, c), and how many places were looked at.

    One at a corner of the ear does not count: where a notch of the outline begins there, its far
    end is reflex, too.
    """
    looked = 0
    left = min(points[a, 0], points[b, 0], points[c, 0])
    right = max(points[a, 0], points[b, 0], points[c, 0])
    bottom = min(points[a, 1], points[b, 1], points[c, 1])
    top = max(points[a, 1], points[b, 1], points[c, 1])
    for row in range(_cell(bottom, low_y, scale, across), _cell(top, low_y, scale, across) + 1):
        begin = _cell(left, low_x, scale, across)
        for column in range(begin, _cell(right, low_x, scale, across) + 1):
            looked += 1
            before, place = -1, heads[row, column]
            while place >= 0:
                looked += 1
                after = following[place]
                if reflex_at[place] == 0:  # all cut off or convex by now, and never reflex again
                    if before < 0:
                        heads[row, column] = after
                    else:
                        following[before] = after
                    place = after
                    continue
                if place != places[a] and place != places[b] and place != places[c]:
                    p = corner_at[place]
                    one = _twice_area(points, a, b, p)
                    two = _twice_area(points, b, c, p)
                    three = _twice_area(points, c, a, p)
                    if strictness == _STRICTLY:
                        inside = one > 0.0 and two > 0.0 and three > 0.0
                    else:
                        inside = one >= 0.0 and two >= 0.0 and three >= 0.0
                    if inside:
                        return True, looked
                before, place = place, after
    return False, looked


@kernel("float64[:, :], int64[:], int64, int64[:, :]")
def clip_ears(points, places, most_looks, triangles):
    """Fill ``triangles`` (n - 2, 3) with corners of a ring; how many were needed.

    ``points``      (n, 2) float64, finite, counter-clockwise.
    ``places``      (n,) int64, 0 to n - 1, the same for corners that lie at the same place: however
                    many these are, they are looked at as one.
    ``most_looks``  places that are looked at in all, to see whether a corner lies in an ear.

    A lap in which no ear is found relaxes what an ear is, first to have nothing strictly inside,
    then to be convex; once the looks are spent every corner is an ear.  The triangles add up to
    the ring whatever is cut off: about each point they turn as often as the ring does.
    """
    count = len(points)
    low_x, low_y = points[:, 0].min(), points[:, 1].min()
    extent = max(points[:, 0].max() - low_x, points[:, 1].max() - low_y)
    before = np.arange(-1, count - 1)
    after = np.arange(1, count + 1)
    before[0], after[count - 1] = count - 1, 0
    reflex = np.zeros(count, dtype=np.bool_)
    reflex_at = np.zeros(count, dtype=np.int64)  # corners, by place
    corner_at = np.zeros(count, dtype=np.int64)  # one of them
    following = np.full(count, -1, dtype=np.int64)  # the next place in the same cell
    across, scale = 0, 0.0
    heads = np.empty((0, 0), dtype=np.int64)
    cut, left, lap, strictness, looks, b = 0, count, 0, _WITHIN, 0, 0
    while left > 2:
        if across == 0 or left < across * across // 2:  # ears grow: so do the cells
            across = max(int(np.sqrt(left)), 1)
            scale = across / extent if extent > 0.0 else 0.0
            heads = np.full((across, across), -1, dtype=np.int64)
            reflex_at[:] = 0
            for _ in range(left):
                b = after[b]
                reflex[b] = _twice_area(points, before[b], b, after[b]) < 0.0
                if reflex[b]:
                    place = places[b]
                    reflex_at[place] += 1
                    if reflex_at[place] == 1:
                        row = _cell(points[b, 1], low_y, scale, across)
                        column = _cell(points[b, 0], low_x, scale, across)
                        corner_at[place] = b
                        following[place] = heads[row, column]
                        heads[row, column] = place
        a, c = before[b], after[b]
        area = _twice_area(points, a, b, c)
        if looks >= most_looks:
            strictness = _ANY
        ear = area == 0.0 or (strictness == _ANY and (area > 0.0 or looks >= most_looks))
        if not ear and area > 0.0:
            blocked, looked = _blocked(
                points, places, a, b, c, heads, following, corner_at, reflex_at, across, low_x,
                low_y, scale, strictness
            )  # fmt: skip
            looks += looked
            ear = not blocked
        looks += 1
        if not ear:
            b = c
            lap += 1
            if lap >= left:
                # A lap of reflex corners alone has nothing that could be relaxed any more.
                looks = most_looks if strictness == _ANY else looks
                strictness, lap = min(strictness + 1, _ANY), 0
            continue
        if area != 0.0:
            triangles[cut, 0], triangles[cut, 1], triangles[cut, 2] = a, b, c
            cut += 1
        after[a], before[c] = c, a
        left -= 1
        for p in (a, b, c):
            if reflex[p] and (p == b or _twice_area(points, before[p], p, after[p]) >= 0.0):
                reflex[p] = False
                reflex_at[places[p]] -= 1
        strictness, lap = _WITHIN, 0
        # Not beside the last one: cutting on along one side makes slivers.
        b = c if area == 0.0 else after[c]
    return cut
