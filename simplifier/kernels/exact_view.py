"""What a point sees along upright planes, past walls that stand on a plan.

Along an azimuth a line of sight is told by its *slope*, the height that it gains per length of
plan.  A wall at distance t with its top at h hides what is behind it up to the slope (h - z) / t.
Above the eye a prism hides most where the line enters it, below the eye where the line leaves it.

What is reported is a proof, so whatever rounding could decide ends the line: a corner within
``reach`` of it, a wall through the eye, or more walls than there is room for.
"""

from __future__ import annotations

import math

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

ROOM = 512
"""Walls of some cells of the grid that a line crosses, and prisms that it is over at once."""

_DOWN = -1e300  # slope of a line that nothing has lifted yet
_SHARE = (
    1e-6  # of slopes, by which one must be steeper: what walls nearly along the line may be off
)


@inline_kernel
def _cell_range(low, high, cells):
    first = max(np.int64(math.floor(low)), 0)
    return first, min(np.int64(math.floor(high)), cells - 1)


@kernel("float64[:, :, :], float64, float64[:], float64, int64[:], int64[:], int64[:], bool")
def grid_edges(edges, grow, low, cell, shape, starts, items, fill):
    """Enter the edges in all cells of a grid that they touch, or first count them.

    ``edges``   (e, 2, 2) float64, plan; each is ``grow`` thicker on all sides.
    ``low``     (2,) float64 corner of the grid, ``cell`` its pitch, ``shape`` (2,) int64.
    ``starts``  (cells + 1,) int64: counts at first, cell c at c + 1; with ``fill`` where the next
                edge of each cell goes.
    ``items``   int64 by ``starts``.
    """
    nx, ny = shape[0], shape[1]
    for edge in range(len(edges)):
        ax, ay = edges[edge, 0, 0] - low[0], edges[edge, 0, 1] - low[1]
        bx, by = edges[edge, 1, 0] - low[0], edges[edge, 1, 1] - low[1]
        x0, x1 = _cell_range((min(ax, bx) - grow) / cell, (max(ax, bx) + grow) / cell, nx)
        y0, y1 = _cell_range((min(ay, by) - grow) / cell, (max(ay, by) + grow) / cell, ny)
        across_x, across_y = ay - by, bx - ax
        span = (0.5 * cell + grow) * (abs(across_x) + abs(across_y))
        for x in range(x0, x1 + 1):
            for y in range(y0, y1 + 1):
                off = across_x * ((x + 0.5) * cell - ax) + across_y * ((y + 0.5) * cell - ay)
                if abs(off) > span:
                    continue
                place = x * ny + y
                if fill:
                    items[starts[place]] = edge
                    starts[place] += 1
                else:
                    starts[place + 1] += 1


@inline_kernel
def _enters(ax, ay, bx, by, x, y):
    """1, -1 or 0: how the winding about (x, y) changes by an edge right of it."""
    change = 0
    if (ay > y) != (by > y):
        left = (bx - ax) * (y - ay) - (x - ax) * (by - ay)
        if by > ay and left > 0.0:
            change = 1
        elif by < ay and left < 0.0:
            change = -1
    return change


@inner_kernel
def _prisms_around(x, y, edges, offsets, boxes, around):
    """Fill ``around`` with the prisms whose plan holds (x, y); returns how many."""
    count = 0
    for prism in range(len(boxes)):
        if not (
            boxes[prism, 0] <= x <= boxes[prism, 2] and boxes[prism, 1] <= y <= boxes[prism, 3]
        ):
            continue
        winding = 0
        for edge in range(offsets[prism], offsets[prism + 1]):
            winding += _enters(
                edges[edge, 0, 0], edges[edge, 0, 1], edges[edge, 1, 0], edges[edge, 1, 1], x, y
            )
        if winding != 0 and count < len(around):
            around[count] = prism
            count += 1
    return count


@inner_kernel
def _add_event(times, keys, events, head, count, time, key, event):
    """Keep what lies from ``head`` to ``count`` in the order of keys; returns the new count."""
    place = count
    while place > head and keys[place - 1] > key:
        times[place], keys[place] = times[place - 1], keys[place - 1]
        events[place] = events[place - 1]
        place -= 1
    times[place], keys[place], events[place] = time, key, event
    return count + 1


@inner_kernel
def _follow(
    eye, angle, own, goal, goal_height, edges, owners, tops, targets, starts, items, highest,
    low, cell, top, reach, margin, stamps, stamp, times, keys, events, over, around, found,
):  # fmt: skip
    """Walk along an azimuth, and note in ``found`` which prisms come into view there.

    With ``own`` >= 0 nothing is noted: returns whether the point at distance ``goal`` and height
    ``goal_height`` is in view past all prisms but ``own``.
    """
    x, y, z = eye[0] - low[0], eye[1] - low[1], eye[2]
    dx, dy = math.cos(angle), math.sin(angle)
    nx, ny = highest.shape
    t, leave = 0.0, np.inf
    for axis in range(2):
        at, along, size = (x, dx, nx * cell) if axis == 0 else (y, dy, ny * cell)
        if along != 0.0:
            one, other = -at / along, (size - at) / along
            t, leave = max(t, min(one, other)), min(leave, max(one, other))
        elif at < 0.0 or at > size:
            leave = -1.0
    goal_slope = (goal_height - z) / goal if own >= 0 else 0.0
    slope = _DOWN
    over_count = len(around)
    over[:over_count] = around
    head = count = 0
    ix = min(max(np.int64(math.floor((x + t * dx) / cell)), 0), nx - 1)
    iy = min(max(np.int64(math.floor((y + t * dy) / cell)), 0), ny - 1)
    while t < leave:
        if slope >= 0.0 and top - z <= slope * t:
            break
        if own >= 0 and t > goal + reach:
            break
        next_x = ((ix + (dx > 0.0)) * cell - x) / dx if dx != 0.0 else np.inf
        next_y = ((iy + (dy > 0.0)) * cell - y) / dy if dy != 0.0 else np.inf
        last = min(next_x, next_y)
        # Below the eye all walls count, for they tell which roofs the line is over.
        if slope < 0.0 or highest[ix, iy] - z > slope * t:
            place = ix * ny + iy
            for entry in range(starts[place], starts[place + 1]):
                edge = items[entry]
                if stamps[edge] == stamp:
                    continue
                stamps[edge] = stamp
                ax, ay = edges[edge, 0, 0] - eye[0], edges[edge, 0, 1] - eye[1]
                bx, by = edges[edge, 1, 0] - eye[0], edges[edge, 1, 1] - eye[1]
                side_a, side_b = dx * ay - dy * ax, dx * by - dy * bx
                far_a, far_b = dx * ax + dy * ay, dx * bx + dy * by
                near_a = abs(side_a) <= reach and far_a > -reach
                near_b = abs(side_b) <= reach and far_b > -reach
                event = edge
                if near_a or near_b:
                    event = -edge - 1
                    distance = min(far_a if near_a else np.inf, far_b if near_b else np.inf)
                elif (side_a > 0.0) != (side_b > 0.0):
                    distance = far_a + (far_b - far_a) * (side_a / (side_a - side_b))
                    if abs(distance) <= reach:
                        event = -edge - 1
                    elif distance < 0.0:
                        continue
                else:
                    continue
                if count == len(times):
                    return False
                # Of walls that are shared, the prism that ends there comes first.
                key = distance - 2.0 * reach if event < 0 or side_a < 0.0 else distance
                count = _add_event(times, keys, events, head, count, distance, key, event)
        while head < count and keys[head] <= last:
            distance, event = times[head], events[head]
            head += 1
            if own >= 0 and distance > goal + reach:
                break
            edge = event if event >= 0 else -event - 1
            prism = owners[edge]
            if prism == own:
                continue
            if event < 0:
                if slope >= 0.0 and tops[prism] - z <= slope * distance:
                    continue
                return False
            wall = (tops[prism] - z) / distance
            if own < 0 and targets[prism] and np.isnan(found[prism]):
                steeper = margin / distance + _SHARE * (abs(wall) + abs(slope))
                if wall - slope > steeper and not _is_buried(
                    prism, tops[prism], z, tops, margin, over, over_count
                ):
                    found[prism] = angle
            if slope < 0.0:
                ax, ay = edges[edge, 0, 0] - eye[0], edges[edge, 0, 1] - eye[1]
                if dx * ay - dy * ax > 0.0:
                    if over_count == len(over):
                        return False
                    over[over_count] = prism
                    over_count += 1
                else:
                    over_count = _without(prism, over, over_count)
            slope = max(slope, wall)
        if head == count:
            head = count = 0
        t = last
        if next_x < next_y:
            ix += 1 if dx > 0.0 else -1
        else:
            iy += 1 if dy > 0.0 else -1
        if ix < 0 or ix >= nx or iy < 0 or iy >= ny:
            break
    if own < 0:
        return False
    steeper = margin / goal + _SHARE * (abs(goal_slope) + abs(slope))
    return goal_slope - slope > steeper and not _is_buried(
        own, goal_height, z, tops, margin, over, over_count
    )


@inline_kernel
def _is_buried(prism, height, z, tops, margin, over, over_count):
    """Whether a point on the line is within another prism; one above the eye is hidden then."""
    buried = False
    if height < z:
        for index in range(over_count):
            other = over[index]
            buried = buried or (other != prism and tops[other] > height - margin)
    return buried


@inline_kernel
def _without(prism, over, over_count):
    """Take a prism off the list, if it is there; returns how many are left."""
    for index in range(over_count):
        if over[index] == prism:
            over_count -= 1
            over[index] = over[over_count]
            break
    return over_count


@kernel(
    "float64[:, :], int64, int64, float64[:], float64, float64, float64, float64, "
    "float64[:, :, :], int32[:], int64[:], float64[:, :], float64[:], bool[:], float64[:, :], "
    "int32[:], int64[:], int64[:], float64[:, :], float64[:], float64, float64[:, :]"
)
def see_from(
    eyes, begin, end, angles, near, hair, reach, margin, edges, owners, offsets, boxes, tops,
    targets, points, point_of, starts, items, highest, low, cell, found,
):  # fmt: skip
    """Fill ``found`` of the eyes ``begin`` to ``end`` with azimuths along which prisms are seen.

    ``eyes``      (k, 3) float64.
    ``angles``    (m,) float64: azimuths to look along first, radians from x to y.
    ``near``      then lines are aimed ``hair`` left and right of the corners of prisms that are
                  seen or no further away than this; negative for none.
    ``reach``     a length: who comes this near to a corner touches it.
    ``margin``    a length: as much must be seen of an edge.
    ``edges``     (e, 2, 2) float64, the plan left of each; ``owners`` (e,) int32, ascending.
    ``offsets``   (n + 1,) int64: edges of each prism; ``boxes`` (n, 4) float64: low x, y, high x,
                  y; ``tops`` (n,) float64.
    ``targets``   (n,) bool: whether the prism is the object; else only its points are, ``points``
                  (p, 3) float64 of the objects ``point_of`` (p,) int32.
    ``starts``, ``items``  the edges by cell of the grid, :func:`grid_edges`; ``highest`` (nx, ny)
                  float64: the highest top of its prisms.
    ``found``     (k, n) float64, NaN.
    """
    stamps = np.full(len(edges), -1, np.int64)
    times, keys, events = np.empty(ROOM), np.empty(ROOM), np.empty(ROOM, np.int64)
    over, around = np.empty(ROOM, np.int64), np.empty(ROOM, np.int64)
    aimed = np.empty(len(tops), np.bool_)
    top = highest.max()
    stamp = 0
    for view in range(begin, end):
        eye, row = eyes[view], found[view]
        below = around[: _prisms_around(eye[0], eye[1], edges, offsets, boxes, around)]
        inside = len(below) == ROOM
        for prism in below:
            inside = inside or tops[prism] > eye[2] - margin
        if inside:
            continue
        for angle in angles:
            stamp += 1
            _follow(
                eye, angle, -1, 0.0, 0.0, edges, owners, tops, targets, starts, items, highest,
                low, cell, top, reach, margin, stamps, stamp, times, keys, events, over, below,
                row,
            )  # fmt: skip
        aimed[:] = near < 0.0
        new = True
        while new:
            new = False
            for prism in range(len(tops)):
                if aimed[prism] or (np.isnan(row[prism]) and _away(eye, boxes[prism]) > near):
                    continue
                aimed[prism] = new = True
                for edge in range(offsets[prism], offsets[prism + 1]):
                    away_x, away_y = edges[edge, 0, 0] - eye[0], edges[edge, 0, 1] - eye[1]
                    for side in (-hair, hair):
                        stamp += 1
                        angle = math.atan2(away_y, away_x) + side / max(
                            math.hypot(away_x, away_y), hair
                        )
                        _follow(
                            eye, angle, -1, 0.0, 0.0, edges, owners, tops, targets, starts, items,
                            highest, low, cell, top, reach, margin, stamps, stamp, times, keys,
                            events, over, below, row,
                        )  # fmt: skip
        for point in range(len(points)):
            prism = point_of[point]
            away_x, away_y = points[point, 0] - eye[0], points[point, 1] - eye[1]
            distance = math.hypot(away_x, away_y)
            if not np.isnan(row[prism]) or distance <= reach:
                continue
            stamp += 1
            angle = math.atan2(away_y, away_x)
            if _follow(
                eye, angle, prism, distance, points[point, 2], edges, owners, tops, targets, starts,
                items, highest, low, cell, top, reach, margin, stamps, stamp, times, keys, events,
                over, below, row,
            ):  # fmt: skip
                row[prism] = angle


@inline_kernel
def _away(eye, box):
    """The distance from an eye to a box in the plan."""
    away_x = max(box[0] - eye[0], eye[0] - box[2], 0.0)
    away_y = max(box[1] - eye[1], eye[1] - box[3], 0.0)
    return math.hypot(away_x, away_y)
