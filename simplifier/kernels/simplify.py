"""Ramer-Douglas-Peucker on closed loops, repaired until nothing crosses.

All loops of a polygon lie in one array of *paths*: each loop turned to start at its first anchor
and closed by a copy of that point, so a chord is a pair of rows and never wraps around.  ``keep``
marks the rows that are left; ``first`` (loops + 1) says where each path begins.

Which of many segments meet another one.

Draw apart the corners that a polygon's loops visit more than once.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.planar import TOUCH, cross, is_inside, magnitude, twice_area


@inner_kernel
def _farthest_from(points, begin, end, index):
    """The row of begin..end farthest from a row; the first of several."""
    best, best_distance = begin, -1.0
    x, y = points[index, 0], points[index, 1]
    for other in range(begin, end):
        distance = (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2
        if distance > best_distance:
            best, best_distance = other, distance
    return best


@inner_kernel
def _refine(path, keep, low, high, tolerance, forced, stack):
    """Keep rows between two kept ones until all lie within ``tolerance`` of their chord.

    ``forced`` splits the chord low..high itself even when it is good enough.
    """
    limit = -1.0 if forced else tolerance * tolerance
    stack[0, 0], stack[0, 1] = low, high
    depth = 1
    while depth > 0:
        depth -= 1
        low, high = stack[depth, 0], stack[depth, 1]
        x, y = path[low, 0], path[low, 1]
        chord_x, chord_y = path[high, 0] - x, path[high, 1] - y
        squared = chord_x * chord_x + chord_y * chord_y
        inverse = 1.0 / squared if squared > 0.0 else 0.0
        best, best_distance = -1, limit
        for index in range(low + 1, high):
            dx, dy = path[index, 0] - x, path[index, 1] - y
            t = (dx * chord_x + dy * chord_y) * inverse
            t = 0.0 if t < 0.0 else (1.0 if t > 1.0 else t)
            distance = (dx - t * chord_x) ** 2 + (dy - t * chord_y) ** 2
            if distance > best_distance:
                best, best_distance = index, distance
        if best >= 0:
            keep[best] = True
            stack[depth, 0], stack[depth, 1] = low, best
            stack[depth + 1, 0], stack[depth + 1, 1] = best, high
            depth += 2
        limit = tolerance * tolerance


@inner_kernel
def _kept_points(path, keep, begin, end):
    """The kept points of the path in rows begin..end (its closing row left out)."""
    rows = np.empty((end - begin, 2), np.float64)
    count = 0
    for index in range(begin, end - 1):
        if keep[index]:
            rows[count, 0], rows[count, 1] = path[index, 0], path[index, 1]
            count += 1
    return rows[:count].copy()


@inner_kernel
def _chords(keep, first, alive):
    """(m, 2) rows of the ends of every chord of the loops that are alive."""
    chords = np.empty((len(keep), 2), np.int64)
    count = 0
    for loop in range(len(alive)):
        if not alive[loop]:
            continue
        low = first[loop]
        for index in range(first[loop] + 1, first[loop + 1]):
            if keep[index]:
                chords[count, 0], chords[count, 1] = low, index
                count += 1
                low = index
    return chords[:count]


@inner_kernel
def _split_crossings(path, keep, first, alive, tolerance, slack, stack):
    """Split every chord that meets another one; whether any was."""
    chords = _chords(keep, first, alive)
    segments = np.empty((len(chords), 4), np.float64)
    for index in range(len(chords)):
        for end in range(2):
            segments[index, 2 * end] = path[chords[index, end], 0]
            segments[index, 2 * end + 1] = path[chords[index, end], 1]
    crossed = meeting_segments(segments, slack)
    split = False
    for index in range(len(chords)):
        low, high = chords[index, 0], chords[index, 1]
        if crossed[index] and high - low > 1:
            _refine(path, keep, low, high, tolerance, True, stack)
            split = True
    return split


@inner_kernel
def _drop_strays(path, keep, first, alive):
    """Drop loops that no longer bound the polygon; they do not cross.

    A sliver turned inside out was passed over entirely, so it may go whatever it was.  A hole that
    left the outer loop has nothing to cover, one that fell into another hole is part of it.  No
    hole can swallow the outer loop, as its points lie inside and the anchors are extreme points.
    """
    for loop in range(len(alive)):
        turn = twice_area(_kept_points(path, keep, first[loop], first[loop + 1]))
        alive[loop] = alive[loop] and turn != 0.0 and (turn > 0.0) == (loop == 0)
    for loop in range(1, len(alive)):
        if not alive[loop]:
            continue
        x, y = path[first[loop], 0], path[first[loop], 1]
        for other in range(len(alive)):
            if alive[other] and other != loop:
                wall = _kept_points(path, keep, first[other], first[other + 1])
                if is_inside(x, y, wall) != (other == 0):
                    alive[loop] = False
                    break


@inner_kernel
def _lay_paths(points, starts):
    """Paths, first and keep of the loops, with the two anchors of each kept.

    The anchors are found by going to the farthest point twice: nearly the diameter, and the same
    wherever the loop begins but for ties.
    """
    loops = len(starts) - 1
    path = np.empty((len(points) + loops, 2), np.float64)
    keep = np.zeros(len(path), np.bool_)
    first = np.empty(loops + 1, np.int64)
    for loop in range(loops + 1):
        first[loop] = starts[loop] + loop
    for loop in range(loops):
        begin, end = starts[loop], starts[loop + 1]
        anchor = _farthest_from(points, begin, end, begin)
        far = _farthest_from(points, begin, end, anchor)
        count = end - begin
        row = anchor
        for index in range(first[loop], first[loop + 1]):
            path[index, 0], path[index, 1] = points[row, 0], points[row, 1]
            row = row + 1 if row + 1 < end else begin
        keep[first[loop]] = True
        keep[first[loop] + (far - anchor) % count] = True
        keep[first[loop] + count] = True
    return path, first, keep


@kernel("float64[:, :], int64[:], float64")
def simplify_loops(points, starts, tolerance):
    """Simplify a polygon's loops together; see :func:`simplifier.polygon.simplify`.

    ``points`` (n, 2) float64 with the outer loop first, ``starts`` (loops + 1,) int64.  Returns
    the points and starts of what is left; no loop when the outer one collapsed.
    """
    points = part_touching(points, starts)
    slack = TOUCH * magnitude(points)
    path, first, keep = _lay_paths(points, starts)
    loops = len(starts) - 1
    alive = np.ones(loops, np.bool_)
    stack = np.empty((len(path) + 2, 2), np.int64)
    for loop in range(loops):
        begin, end = first[loop], first[loop + 1] - 1
        middle = begin + 1
        while not keep[middle]:
            middle += 1
        _refine(path, keep, begin, middle, tolerance, False, stack)
        _refine(path, keep, middle, end, tolerance, False, stack)
        small = loop > 0 and abs(twice_area(path[begin:end])) <= 2.0 * tolerance * tolerance
        alive[loop] = not small and np.sum(keep[begin:end]) > 2
    if alive[0]:
        while _split_crossings(path, keep, first, alive, tolerance, slack, stack):
            pass
        _drop_strays(path, keep, first, alive)
    return _collect(path, keep, first, alive)


@inner_kernel
def _collect(path, keep, first, alive):
    """Points and starts of the loops that are alive; nothing without the outer one."""
    rows = np.empty((len(path), 2), np.float64)
    bounds = np.zeros(len(alive) + 1, np.int64)
    loops, count = 0, 0
    for loop in range(len(alive)):
        if not (alive[0] and alive[loop]):
            continue
        for index in range(first[loop], first[loop + 1] - 1):
            if keep[index]:
                rows[count, 0], rows[count, 1] = path[index, 0], path[index, 1]
                count += 1
        loops += 1
        bounds[loops] = count
    return rows[:count].copy(), bounds[: loops + 1].copy()


@inner_kernel
def meeting_segments(segments, slack):
    """(m,) bool: whether each of (m, 4) segments x0, y0, x1, y1 meets another one.

    They are swept in order of their least x, so only those that overlap in x are compared.
    """
    count = len(segments)
    least = np.empty(count, np.float64)
    for index in range(count):
        least[index] = min(segments[index, 0], segments[index, 2])
    order = np.argsort(least)
    swept = segments[order]
    least = least[order]
    meets = np.zeros(count, np.bool_)
    for i in range(count):
        ax, ay, bx, by = swept[i, 0], swept[i, 1], swept[i, 2], swept[i, 3]
        right = max(ax, bx) + slack
        for j in range(i + 1, count):
            if least[j] > right:
                break
            if segments_meet(
                ax, ay, bx, by, swept[j, 0], swept[j, 1], swept[j, 2], swept[j, 3], slack
            ):
                meets[order[i]] = meets[order[j]] = True
    return meets


@inner_kernel
def segments_meet(ax, ay, bx, by, cx, cy, dx, dy, slack):
    """Whether segments ab and cd cross, touch, or come within about ``slack`` of it.

    Segments that share an end point meet only when one runs back along the other.
    """
    if (ay if ay > by else by) + slack < (cy if cy < dy else dy):
        return False
    if (cy if cy > dy else dy) + slack < (ay if ay < by else by):
        return False
    near_ab = slack * np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    near_cd = slack * np.sqrt((dx - cx) ** 2 + (dy - cy) ** 2)
    if ax == cx and ay == cy:
        return _runs_back(ax, ay, bx, by, dx, dy, near_ab + near_cd)
    if ax == dx and ay == dy:
        return _runs_back(ax, ay, bx, by, cx, cy, near_ab + near_cd)
    if bx == cx and by == cy:
        return _runs_back(bx, by, ax, ay, dx, dy, near_ab + near_cd)
    if bx == dx and by == dy:
        return _runs_back(bx, by, ax, ay, cx, cy, near_ab + near_cd)
    to_c = cross(ax, ay, bx, by, cx, cy)
    to_d = cross(ax, ay, bx, by, dx, dy)
    if (to_c > near_ab and to_d > near_ab) or (to_c < -near_ab and to_d < -near_ab):
        return False
    to_a = cross(cx, cy, dx, dy, ax, ay)
    to_b = cross(cx, cy, dx, dy, bx, by)
    return not ((to_a > near_cd and to_b > near_cd) or (to_a < -near_cd and to_b < -near_cd))


@inner_kernel
def _runs_back(x, y, px, py, qx, qy, near):
    """Whether p and q lie in the same direction from the point that their segments share."""
    along = (px - x) * (qx - x) + (py - y) * (qy - y)
    return along > 0.0 and abs(cross(x, y, px, py, qx, qy)) <= near


_PULL = 1e-3  # how far touching corners are drawn apart, in shortest edges


@inner_kernel
def part_touching(points, starts):
    """A copy of the loops in which no corner is visited twice.

    Of the visits to one point, every convex one is pulled into the covered side, by a thousandth
    of the polygon's shortest edge along both of its edges.  At most one visit is reflex.
    """
    count = len(points)
    size = 4
    while size < 2 * count:
        size *= 2
    table = np.full(size, -1, np.int64)  # open addressing; equal points have equal keys
    touching = np.zeros(count, np.bool_)
    found = False
    for index in range(count):
        x, y = points[index, 0], points[index, 1]
        slot = np.int64(x * 7919.0 + y * 104729.0) & (size - 1)
        while table[slot] >= 0:
            other = table[slot]
            if points[other, 0] == x and points[other, 1] == y:
                touching[index] = touching[other] = found = True
            slot = (slot + 1) & (size - 1)
        table[slot] = index
    parted = points.copy()
    if found:
        pull = _PULL * _shortest_edge(points, starts)
        for loop in range(len(starts) - 1):
            _pull_corners(points, starts[loop], starts[loop + 1], touching, pull, parted)
    return parted


@inner_kernel
def _shortest_edge(points, starts):
    shortest = np.inf
    for loop in range(len(starts) - 1):
        previous = starts[loop + 1] - 1
        for index in range(starts[loop], starts[loop + 1]):
            length = np.hypot(
                points[index, 0] - points[previous, 0], points[index, 1] - points[previous, 1]
            )
            if length > 0.0:
                shortest = min(shortest, length)
            previous = index
    return shortest


@inner_kernel
def _pull_corners(points, begin, end, touching, pull, parted):
    for index in range(begin, end):
        if not touching[index]:
            continue
        x, y = points[index]
        before = index - 1 if index > begin else end - 1
        after = index + 1 if index + 1 < end else begin
        back_x, back_y = points[before, 0] - x, points[before, 1] - y
        on_x, on_y = points[after, 0] - x, points[after, 1] - y
        if on_x * back_y - on_y * back_x > 0.0:
            back, on = np.hypot(back_x, back_y), np.hypot(on_x, on_y)
            parted[index, 0] = x + pull * (back_x / back + on_x / on)
            parted[index, 1] = y + pull * (back_y / back + on_y / on)
