"""Which boxes one convex occluder hides from a convex cell, by segments between their corners.

Cohen-Or et al., "Conservative Visibility and Strong Occlusion for Viewspace Partitioning of Densely
Occluded Scenes" (1998).  A convex body hides a target from a cell when each segment from a corner
of the cell to a corner of the target meets it.  Of a body that is clear of both, the segments that
are edges of the hull of both are enough (their optimization 3): the points at which it meets them
span a ring around that hull, and a film in the body across it parts the two.

A body is ``kind``, and rows ``first`` to ``last`` of ``planes`` (p, 4) float64, which are already
shrunk by the margin: VOLUME all points n x <= d; FLAT a polygon, its plane n x = d, then its edges;
SPHERE the centre and the radius.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel, kernel

VOLUME, FLAT, SPHERE = 0, 1, 2

NO_PIECES, FIRST_PIECE, ALL_PIECES = 0, 1, 2
"""Whether triangles of targets are looked at: not, up to the first that is not hidden, or all."""

RAYS, TARGETS, PIECE_RAYS = 0, 1, 2
"""Of ``work``: tests of a segment against a body, boxes looked at, tests for triangles."""

_STACK = 128  # a balanced tree of 2^63 leaves needs no more
_MOST_RAYS = 64

_LUCKY = 0.4  # share of groups of a size that are hidden, from which a look at them pays
_HEED = 0.1  # of that share that the last group counts for
_AGAIN = 16  # where it does not pay, one of so many groups is looked at nevertheless


@inner_kernel
def _meets_flat(planes, first, last, a, b, margin):
    """Whether a segment goes through a polygon, from one side to the other."""
    n = planes[first]
    fa = n[0] * a[0] + n[1] * a[1] + n[2] * a[2] - n[3]
    fb = n[0] * b[0] + n[1] * b[1] + n[2] * b[2] - n[3]
    if min(fa, fb) > -margin or max(fa, fb) < margin:
        return False
    t = fa / (fa - fb)
    x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
    for row in range(first + 1, last):
        n = planes[row]
        if n[0] * x + n[1] * y + n[2] * z > n[3]:
            return False
    return True


@inner_kernel
def _meets_sphere(centre, a, b):
    along, to = 0.0, 0.0
    for axis in range(3):
        step = b[axis] - a[axis]
        along += step * step
        to += step * (centre[axis] - a[axis])
    t = min(max(to / along, 0.0), 1.0) if along > 0.0 else 0.0
    square = 0.0
    for axis in range(3):
        square += (a[axis] + t * (b[axis] - a[axis]) - centre[axis]) ** 2
    return square <= centre[3] * centre[3]


@inner_kernel
def meets(kind, planes, first, last, a, b, margin):
    """Whether the segment from ``a`` to ``b``, each (3,), meets a body."""
    if kind == FLAT:
        return _meets_flat(planes, first, last, a, b, margin)
    if kind == SPHERE:
        return _meets_sphere(planes[first], a, b)
    enter, leave = 0.0, 1.0
    ax, ay, az = a[0], a[1], a[2]
    bx, by, bz = b[0], b[1], b[2]
    for row in range(first, last):
        x, y, z, d = planes[row, 0], planes[row, 1], planes[row, 2], planes[row, 3]
        fa = x * ax + y * ay + z * az - d
        fb = x * bx + y * by + z * bz - d
        if fa > 0.0:
            if fb > 0.0:
                return False
            enter = max(enter, fa / (fa - fb))
        elif fb > 0.0:
            leave = min(leave, fa / (fa - fb))
        if enter > leave:
            return False
    return True


@inner_kernel
def _clear_of(kind, planes, first, last, box, points, low, high):
    """Whether a body surely has no point of the hull of ``points``, of which the box is given."""
    for axis in range(3):
        if box[axis] > high[axis] or box[3 + axis] < low[axis]:
            return True
    if kind == SPHERE:
        return False
    for row in range(first, last):
        n = planes[row]
        nearest, furthest = np.inf, -np.inf
        for k in range(len(points)):
            f = n[0] * points[k, 0] + n[1] * points[k, 1] + n[2] * points[k, 2] - n[3]
            nearest, furthest = min(nearest, f), max(furthest, f)
        if nearest > 0.0 or (kind == FLAT and row == first and furthest < 0.0):
            return True
    return False


@inner_kernel
def apart(cell_planes, corners, low, high):
    """Whether a box is clear of a cell, of which the planes (k, 4) and corners are given; one that
    touches it is not."""
    for row in range(len(cell_planes)):
        n = cell_planes[row]
        f = -n[3]
        for axis in range(3):
            f += n[axis] * (low[axis] if n[axis] > 0.0 else high[axis])
        if f > 0.0:
            return True
    for axis in range(3):
        least, most = np.inf, -np.inf
        for k in range(len(corners)):
            least, most = min(least, corners[k, axis]), max(most, corners[k, axis])
        if least > high[axis] or most < low[axis]:
            return True
    return False


@inner_kernel
def bridges(corners, points, pairs, cones, rays):
    """Put the segments that may be edges of the hull of cell and target into ``rays`` (r, 2) int64;
    return how many.

    ``pairs``  (r, 2) int64: a corner of the cell, and one of the target, that are furthest in
               common directions.  ``cones``  (r, 3, 3) float64: what spans these.  A segment that
               leads on, or back, along all of them is within the hull.
    """
    count = 0
    for k in range(len(pairs)):
        a, b = corners[pairs[k, 0]], points[pairs[k, 1]]
        on, back = True, True
        for side in range(3):
            g = cones[k, side]
            step = g[0] * (b[0] - a[0]) + g[1] * (b[1] - a[1]) + g[2] * (b[2] - a[2])
            on &= step > 0.0
            back &= step < 0.0
        if not (on or back):
            rays[count, 0], rays[count, 1] = pairs[k, 0], pairs[k, 1]
            count += 1
    return count


@inner_kernel
def _covers(body, bodies, target, corners, margin, rays, count, work, tally):
    """Whether a body hides a target, the hull of its points, from the cell with these corners.

    Without bridges, ``count`` 0, and where the body is not clear of the target, all segments count.
    """
    kinds, starts, planes, boxes = bodies
    points, low, high, _, _, _ = target
    kind, first, last = kinds[body], starts[body], starts[body + 1]
    if count > 0 and _clear_of(kind, planes, first, last, boxes[body], points, low, high):
        for k in range(count):
            work[tally] += 1
            a, b = corners[rays[k, 0]], points[rays[k, 1]]
            if not meets(kind, planes, first, last, a, b, margin):
                return False
        return True
    for i in range(len(corners)):
        for j in range(len(points)):
            work[tally] += 1
            if not meets(kind, planes, first, last, corners[i], points[j], margin):
                return False
    return True


@inner_kernel
def _entry(box, a, inverse):
    """Where a segment enters a box, 0 to 1; more than 1 where it does not."""
    enter, leave = 0.0, 1.0
    for axis in range(3):
        s = (box[axis] - a[axis]) * inverse[axis]
        t = (box[3 + axis] - a[axis]) * inverse[axis]
        enter, leave = max(enter, min(s, t)), min(leave, max(s, t))
        if enter > leave:
            return 2.0
    return enter if enter <= leave else 2.0


@inner_kernel
def _cover(cell, bodies, tree, usable, target, rays, count, cache, cached, work, tally):
    """A body that hides a target from a cell, or -1.

    ``target``  (points, low, high, aim, own, beyond): the leading ray ends at ``aim``, a point of
                its hull; bodies from ``own`` on, before ``beyond``, are its own and not looked at.
    Those that hid the targets before come first, then those that the leading ray meets, which are
    all that may; near ones before far ones.
    """
    corners, _, eye, margin = cell
    node_boxes, rights, items = tree
    _, _, _, aim, own, beyond = target
    for place in range(cached):
        body = cache[place]
        if (
            body >= 0
            and usable[body]
            and not own <= body < beyond
            and _covers(body, bodies, target, corners, margin, rays, count, work, tally)
        ):
            for before in range(place, 0, -1):
                cache[before] = cache[before - 1]
            cache[0] = body
            return body
    inverse = np.empty(3)
    for axis in range(3):
        step = aim[axis] - eye[axis]
        inverse[axis] = 1.0 / step if step != 0.0 else 1e300
    stack = np.empty(_STACK, dtype=np.int64)
    stack[0] = 0
    waiting = 1 if _entry(node_boxes[0], eye, inverse) <= 1.0 else 0
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if rights[node] < 0:
            body = items[node]
            if (
                usable[body]
                and not own <= body < beyond
                and _covers(body, bodies, target, corners, margin, rays, count, work, tally)
            ):
                for before in range(cached - 1, 0, -1):
                    cache[before] = cache[before - 1]
                if cached > 0:
                    cache[0] = body
                return body
            continue
        near, far = node + 1, rights[node]
        s, t = _entry(node_boxes[near], eye, inverse), _entry(node_boxes[far], eye, inverse)
        if t < s:
            near, far, s, t = far, near, t, s
        if t <= 1.0:
            stack[waiting] = far
            waiting += 1
        if s <= 1.0:
            stack[waiting] = near
            waiting += 1
    return -1


@inner_kernel
def _fit(tree, hidden, boxes, left):
    """The boxes of groups around those targets that are ``left``, and how many these are."""
    own, rights, items = tree
    for node in range(len(rights) - 1, -1, -1):
        if rights[node] < 0:
            boxes[node] = own[node]
            left[node] = 0 if hidden[items[node]] else 1
            continue
        first, second = node + 1, rights[node]
        left[node] = left[first] + left[second]
        for axis in range(3):
            low, high = np.inf, -np.inf
            for child in (first, second):
                if left[child] > 0:
                    low = min(low, boxes[child, axis])
                    high = max(high, boxes[child, 3 + axis])
            boxes[node, axis], boxes[node, 3 + axis] = low, high


@inner_kernel
def _corners_of(box, points):
    """The corners of a box into ``points`` (8, 3), numbered 4 x + 2 y + z."""
    for k in range(8):
        points[k, 0] = box[3 * (k >> 2)]
        points[k, 1] = box[1 + 3 * ((k >> 1) & 1)]
        points[k, 2] = box[2 + 3 * (k & 1)]


@inner_kernel
def _hide_all(node, tree, hidden, by, body, body_starts, usable, dilute):
    """All targets below a node are hidden by a body; the bodies of these hide nothing more."""
    _, rights, items = tree
    stack = np.empty(_STACK, dtype=np.int64)
    stack[0] = node
    waiting = 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if rights[node] >= 0:
            stack[waiting], stack[waiting + 1] = node + 1, rights[node]
            waiting += 2
            continue
        target = items[node]
        if hidden[target]:
            continue
        hidden[target] = True
        by[target] = body
        if dilute:
            for own in range(body_starts[target], body_starts[target + 1]):
                usable[own] = False


@inner_kernel
def _pieces_hidden(
    target,
    own,
    beyond,
    cell,
    bodies,
    tree,
    usable,
    pieces,
    mode,
    piece_hidden,
    cache,
    cached,
    rays,
    work,
):
    """Whether all triangles of a target are hidden, each by a body of its own."""
    starts, triangles = pieces
    if starts[target] == starts[target + 1]:
        return False
    low, high = np.empty(3), np.empty(3)
    every = True
    for piece in range(starts[target], starts[target + 1]):
        points = triangles[piece]
        for axis in range(3):
            low[axis] = min(points[0, axis], points[1, axis], points[2, axis])
            high[axis] = max(points[0, axis], points[1, axis], points[2, axis])
        highest = 0
        for corner in (1, 2):
            if points[corner, 2] > points[highest, 2]:
                highest = corner
        one = (points, low, high, points[highest], own, beyond)
        found = _cover(cell, bodies, tree, usable, one, rays, 0, cache, cached, work, PIECE_RAYS)
        piece_hidden[piece] = found >= 0
        every &= found >= 0
        if not every and mode == FIRST_PIECE:
            return False
    return every


@kernel(
    "(float64[:, :], float64[:, :], float64[:], float64), int64[:, :], float64[:, :, :], "
    "(uint8[:], int64[:], float64[:, :], float64[:, :]), (float64[:, :], int64[:], int64[:]), "
    "(float64[:, :], int64[:], int64[:]), int64[:], (int64[:], float64[:, :, :]), int64[:], "
    "bool[:], bool[:], int64[:], bool[:], int64[:]"
)
def hide_from_cell(
    cell, pairs, cones, bodies, body_tree, target_tree, body_starts, pieces, tactics, usable,
    hidden, by, piece_hidden, work,
):  # fmt: skip
    """Find the targets that are hidden from one cell.

    ``cell``     (corners (k, 3), planes (j, 4), eye (3,), margin).  From the eye, a point of the
                 cell, leading rays go out; from a high one to high targets they meet fewest bodies.
    ``pairs``, ``cones``  of :func:`bridges`; without pairs all segments are tested.
    ``bodies``   (kinds (m,) uint8, starts (m + 1,) int64, planes (p, 4), boxes (m, 6)).
    ``body_tree``, ``target_tree``  (boxes (2 m - 1, 6), rights int64, items int64), in preorder:
                 the first child of a node is the next one, the second ``rights``, -1 in leaves.
    ``body_starts``  (n + 1,) int64: the bodies that are parts of each target.
    ``pieces``   (starts (n + 1,) int64, triangles (t, 3, 3)).
    ``tactics``  (4,) int64: bodies in the cache, whether hidden targets stop hiding, most targets
                 of a group that is looked at as one, and which pieces.
    ``usable``   (m,) bool: of bodies that may hide anything; changed.
    ``hidden``   (n,) bool: those known to be hidden, and afterwards all that are.
    ``by``       (n,) int64: the body that hides each; left alone where several do, or none.
    ``piece_hidden``  (t,) bool.  ``work`` (3,) int64, counted up.
    """
    corners, cell_planes, eye, _ = cell
    _, rights, items = target_tree
    cached, dilute, most, mode = tactics
    boxes = np.empty((len(rights), 6))
    left = np.empty(len(rights), dtype=np.int64)
    _fit(target_tree, hidden, boxes, left)
    cache = np.full(max(cached, 1), -1, dtype=np.int64)
    rays = np.empty((_MOST_RAYS, 2), dtype=np.int64)
    points, aim = np.empty((8, 3)), np.empty(3)
    luck, passed = np.ones(_STACK), np.zeros(_STACK, dtype=np.int64)
    stack = np.empty(_STACK, dtype=np.int64)
    stack[0] = 0
    waiting = 1
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if left[node] == 0:
            continue
        leaf = rights[node] < 0
        low, high = boxes[node, :3], boxes[node, 3:]
        worthwhile = leaf
        level = 0
        if not leaf and 2 <= left[node] <= most:
            while left[node] >> level > 1:
                level += 1
            passed[level] += 1
            worthwhile = luck[level] > _LUCKY or passed[level] % _AGAIN == 0
        if worthwhile and apart(cell_planes, corners, low, high):
            work[TARGETS] += 1
            _corners_of(boxes[node], points)
            count = bridges(corners, points, pairs, cones, rays)
            own, beyond = 0, 0
            if leaf:
                own, beyond = body_starts[items[node]], body_starts[items[node] + 1]
            aim[0], aim[1], aim[2] = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), high[2]
            target = (points, low, high, aim, own, beyond)
            body = _cover(
                cell, bodies, body_tree, usable, target, rays, count, cache, cached, work, RAYS
            )
            if not leaf:
                luck[level] += _HEED * ((1.0 if body >= 0 else 0.0) - luck[level])
            if body >= 0:
                _hide_all(node, target_tree, hidden, by, body, body_starts, usable, dilute)
                continue
            if leaf and mode != NO_PIECES:
                hidden[items[node]] = _pieces_hidden(
                    items[node], own, beyond, cell, bodies, body_tree, usable, pieces, mode,
                    piece_hidden, cache, cached, rays, work,
                )  # fmt: skip
        if not leaf:
            near, far = node + 1, rights[node]
            if _distance(boxes[far], eye) < _distance(boxes[near], eye):
                near, far = far, near
            stack[waiting], stack[waiting + 1] = far, near
            waiting += 2


@inner_kernel
def _distance(box, point):
    """The square of how far a point is from a box."""
    square = 0.0
    for axis in range(3):
        square += max(box[axis] - point[axis], point[axis] - box[3 + axis], 0.0) ** 2
    return square


@kernel("(uint8[:], int64[:], float64[:, :], float64[:, :]), float64[:, :], float64[:, :], bool[:]")
def clear_bodies(bodies, corners, cell_planes, usable):
    """Take from ``usable`` (m,) bool the bodies that are not clear of a cell."""
    kinds, starts, planes, boxes = bodies
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        low[axis], high[axis] = corners[:, axis].min(), corners[:, axis].max()
    for body in range(len(kinds)):
        usable[body] &= _clear_of(
            kinds[body], planes, starts[body], starts[body + 1], boxes[body], corners, low, high
        ) or apart(cell_planes, corners, boxes[body, :3], boxes[body, 3:])
