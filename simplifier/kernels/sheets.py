"""Whether sheets of triangles close all lines of sight between two boxes, whatever their shape.

Lines between two boxes lie in their hull.  Let some triangles be such that each edge of theirs in
the hull has an even number of them, and that none touches either box.  As a line is moved from one
end to another, it then crosses them an odd number of times always, or never: crossings come and go
in pairs but at a border or at an end of the line (V. Guillemin and A. Pollack, "Differential
Topology", 1974, section 2.4).  So if one line crosses an odd number, all do.

All boxes are rows (x0, y0, z0, x1, y1, z1) in voxels.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inner_kernel
from simplifier.kernels.disjoint_sets import root_of

CLEAR, MET, SHUT = 0, 1, 2
"""The middle line between two boxes meets no triangle, it meets some, and no line gets through."""

MOST = 1024
"""Triangles in a hull; where there are more, no sheet is looked for."""

PLANES = 12
_NEAR = 1e-6  # voxels: what is no further from a hull counts as in it
_DEPTH = 64  # nodes that wait; two children a node
_FIRST, _SECOND = (0.4871, 0.5063, 0.5122), (0.5279, 0.4717, 0.4838)  # of boxes, for two lines


@inner_kernel
def _bound(a, b, axes, planes):
    """Set the planes along an axis around the hull of two boxes that no side of a box is in.

    ``axes`` (k, 2) int64 the two others, ``planes`` (k, 3) float64: their factors, at most 1, and
    the most that their sum is.  Returns how many there are.
    """
    count = 0
    for u in range(3):
        v = (u + 1) % 3
        for corner in range(4):
            i, j = u + 3 * (corner % 2), v + 3 * (corner // 2)
            nu, nv = b[j] - a[j], a[i] - b[i]
            size = max(abs(nu), abs(nv))
            if min(abs(nu), abs(nv)) <= 1e-9 * size:
                continue
            nu, nv = nu / size, nv / size
            if (nu > 0.0) != (i > 2):
                nu, nv = -nu, -nv
            if (nv > 0.0) != (j > 2):
                continue
            axes[count, 0], axes[count, 1] = u, v
            planes[count, 0], planes[count, 1] = nu, nv
            planes[count, 2] = max(nu * a[i] + nv * a[j], nu * b[i] + nv * b[j]) + _NEAR
            count += 1
    return count


@inner_kernel
def _is_box_out(box, hull, axes, planes, count):
    """Whether a box is outside of a side of the hull."""
    for axis in range(3):
        if box[axis] > hull[axis + 3] or box[axis + 3] < hull[axis]:
            return True
    for k in range(count):
        u, v = axes[k, 0], axes[k, 1]
        nu, nv = planes[k, 0], planes[k, 1]
        least = nu * (box[u] if nu > 0.0 else box[u + 3])
        least += nv * (box[v] if nv > 0.0 else box[v + 3])
        if least > planes[k, 2]:
            return True
    return False


@inner_kernel
def _is_edge_out(p, q, hull, axes, planes, count):
    """Whether both ends of an edge are outside of the same side of the hull."""
    for axis in range(3):
        if min(p[axis], q[axis]) > hull[axis + 3] or max(p[axis], q[axis]) < hull[axis]:
            return True
    for k in range(count):
        u, v = axes[k, 0], axes[k, 1]
        nu, nv, most = planes[k, 0], planes[k, 1], planes[k, 2]
        if nu * p[u] + nv * p[v] > most and nu * q[u] + nv * q[v] > most:
            return True
    return False


@inner_kernel
def _is_face_out(p, q, r, hull, axes, planes, count):
    """Whether all corners of a triangle are outside of the same side of the hull."""
    for axis in range(3):
        if min(p[axis], q[axis], r[axis]) > hull[axis + 3]:
            return True
        if max(p[axis], q[axis], r[axis]) < hull[axis]:
            return True
    for k in range(count):
        u, v = axes[k, 0], axes[k, 1]
        nu, nv, most = planes[k, 0], planes[k, 1], planes[k, 2]
        if (
            nu * p[u] + nv * p[v] > most
            and nu * q[u] + nv * q[v] > most
            and nu * r[u] + nv * r[v] > most
        ):
            return True
    return False


@inner_kernel
def _sides(p, normal, box):
    """The least and the most of a box along a normal, from the plane through ``p`` on."""
    middle = reach = 0.0
    for axis in range(3):
        half = 0.5 * (box[axis + 3] - box[axis])
        middle += normal[axis] * (box[axis] + half - p[axis])
        reach += abs(normal[axis]) * half
    return middle - reach, middle + reach


@inner_kernel
def _touches(p, q, r, low, high, box):
    """Whether a triangle may touch a box, from which its plane is ``low`` to ``high``."""
    if low > _NEAR or high < -_NEAR:
        return False
    for axis in range(3):
        if min(p[axis], q[axis], r[axis]) > box[axis + 3] + _NEAR:
            return False
        if max(p[axis], q[axis], r[axis]) < box[axis] - _NEAR:
            return False
    # The cross products of the triangle's edges and the axes (Akenine-Moeller, "Fast 3D
    # Triangle-Box Overlap Testing", 2001).
    for side in range(3):
        s, t, o = (p, q, r) if side == 0 else ((q, r, p) if side == 1 else (r, p, q))
        for u in range(3):
            v = (u + 1) % 3
            nu, nv = t[v] - s[v], s[u] - t[u]
            size = max(abs(nu), abs(nv))
            if size == 0.0:
                continue
            along, other = nu * s[u] + nv * s[v], nu * o[u] + nv * o[v]
            least = nu * (box[u] if nu > 0.0 else box[u + 3])
            least += nv * (box[v] if nv > 0.0 else box[v + 3])
            most = nu * (box[u + 3] if nu > 0.0 else box[u])
            most += nv * (box[v + 3] if nv > 0.0 else box[v])
            near = _NEAR * size
            if min(along, other) > most + near or max(along, other) < least - near:
                return False
    return True


@inner_kernel
def _touches_box(face, points, faces, normals, box):
    """Whether a triangle may touch a box."""
    p, q, r = points[faces[face, 0]], points[faces[face, 1]], points[faces[face, 2]]
    low, high = _sides(p, normals[face], box)
    return _touches(p, q, r, low, high, box)


@inner_kernel
def _turns(start, way, p, q, first, last):
    """Whether a line passes an edge on one of its sides; the same from either end of the edge."""
    if first > last:
        p, q = q, p
    ax, ay, az = p[0] - start[0], p[1] - start[1], p[2] - start[2]
    bx, by, bz = q[0] - start[0], q[1] - start[1], q[2] - start[2]
    turn = (
        way[0] * (ay * bz - az * by) + way[1] * (az * bx - ax * bz) + way[2] * (ax * by - ay * bx)
    )
    return (turn >= 0.0) != (first > last)


@inner_kernel
def _crossing(start, way, face, points, normal):
    """How far along a line from ``start`` it crosses a triangle, from 0 to 1, or -1."""
    p, q, r = points[face[0]], points[face[1]], points[face[2]]
    one = _turns(start, way, p, q, face[0], face[1])
    if _turns(start, way, q, r, face[1], face[2]) != one:
        return -1.0
    if _turns(start, way, r, p, face[2], face[0]) != one:
        return -1.0
    speed = normal[0] * way[0] + normal[1] * way[1] + normal[2] * way[2]
    if speed == 0.0:
        return -1.0
    rise = 0.0
    for axis in range(3):
        rise += normal[axis] * (p[axis] - start[axis])
    share = rise / speed
    return share if 0.0 <= share <= 1.0 else -1.0


@inner_kernel
def _line(a, b, shares, start, way):
    """Set a line from one box to the other."""
    for axis in range(3):
        start[axis] = a[axis] + shares[axis] * (a[axis + 3] - a[axis])
        way[axis] = b[axis] + shares[(axis + 1) % 3] * (b[axis + 3] - b[axis]) - start[axis]


@inner_kernel
def is_line_clear(start, end, points, faces, normals, boxes, children):
    """Whether the line from a point (3,) to another meets no triangle.

    Arrays as for :func:`close`.
    """
    way = end - start
    stack = np.empty(_DEPTH, np.int64)
    stack[0], count = len(boxes) - 1, 1
    while count > 0:
        count -= 1
        node = stack[count]
        box = boxes[node]
        near, far = 0.0, 1.0
        for axis in range(3):
            if way[axis] == 0.0:
                if start[axis] < box[axis] - _NEAR or start[axis] > box[axis + 3] + _NEAR:
                    near = 2.0
                continue
            one = (box[axis] - _NEAR - start[axis]) / way[axis]
            other = (box[axis + 3] + _NEAR - start[axis]) / way[axis]
            near, far = max(near, min(one, other)), min(far, max(one, other))
        if near > far:
            continue
        first, last = children[node, 0], children[node, 1]
        if first == last:
            if _crossing(start, way, faces[node], points, normals[node]) >= 0.0:
                return False
            continue
        for child in range(first, last):
            stack[count] = child
            count += 1
    return True


@inner_kernel
def close(a, b, points, faces, normals, beside, boxes, children, known, share):
    """What is between two boxes that are apart: :data:`CLEAR`, :data:`MET` or :data:`SHUT`.

    ``points``   (n, 3) float64, welded; ``faces`` (m, 3) int32; ``normals`` (m, 3) float64, unit.
    ``beside``   (m, 3) int32: the triangle across the edge from each corner to the next, -1 at a
                 border.  Edges of several triangles have these in pairs.
    ``boxes``, ``children``  the tree of the triangles' boxes, which are its first m nodes in order.
    ``known``    (m,) int32, all -1 before and after.
    ``share``    (1,) float64: how far along the middle line it first meets one, where it does.
    """
    start, way = np.empty(3), np.empty(3)
    _line(a, b, _FIRST, start, way)
    if is_line_clear(start, start + way, points, faces, normals, boxes, children):
        return CLEAR
    share[0] = 0.5
    axes, planes = np.empty((PLANES, 2), np.int64), np.empty((PLANES, 3))
    count = _bound(a, b, axes, planes)
    hull = np.empty(6)
    for axis in range(3):
        hull[axis] = min(a[axis], b[axis]) - _NEAR
        hull[axis + 3] = max(a[axis + 3], b[axis + 3]) + _NEAR
    stack, found = np.empty(_DEPTH, np.int64), np.empty(MOST, np.int64)
    stack[0], waiting, used = len(boxes) - 1, 1, 0
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if _is_box_out(boxes[node], hull, axes, planes, count):
            continue
        first, last = children[node, 0], children[node, 1]
        if first < last:
            for child in range(first, last):
                stack[waiting] = child
                waiting += 1
            continue
        p, q, r = points[faces[node, 0]], points[faces[node, 1]], points[faces[node, 2]]
        if _is_face_out(p, q, r, hull, axes, planes, count):
            continue
        low_a, high_a = _sides(p, normals[node], a)
        low_b, high_b = _sides(p, normals[node], b)
        if min(low_a, low_b) > _NEAR or max(high_a, high_b) < -_NEAR:
            continue
        if used == MOST:
            return MET
        found[used] = node
        used += 1
    crossed, earliest = np.empty(MOST, np.bool_), 1.0
    for place in range(used):
        face = found[place]
        at = _crossing(start, way, faces[face], points, normals[face])
        crossed[place] = at >= 0.0
        if crossed[place]:
            earliest = min(earliest, at)
    share[0] = earliest
    parent = np.empty(MOST, np.int64)
    odd, broken = np.zeros(MOST, np.bool_), np.zeros(MOST, np.bool_)
    for place in range(used):
        parent[place], known[found[place]] = place, place
    for place in range(used):
        for side in range(3):
            other = beside[found[place], side]
            if other >= 0 and known[other] >= 0:
                parent[root_of(parent, place)] = root_of(parent, known[other])
    for place in range(used):
        known[found[place]] = -1
        odd[root_of(parent, place)] ^= crossed[place]
    for place in range(used):
        root = root_of(parent, place)
        if not odd[root] or broken[root]:
            continue
        face = found[place]
        for side in range(3):
            if beside[face, side] < 0 and not broken[root]:
                p, q = points[faces[face, side]], points[faces[face, (side + 1) % 3]]
                broken[root] = not _is_edge_out(p, q, hull, axes, planes, count)
        if not broken[root]:
            broken[root] = _touches_box(face, points, faces, normals, a) or _touches_box(
                face, points, faces, normals, b
            )
    sound = False
    for place in range(used):
        sound |= parent[place] == place and odd[place] and not broken[place]
    if not sound:
        return MET
    first_odd = odd.copy()
    # A second line, since the first may have been rounded to another side of an edge.
    odd[:] = False
    _line(a, b, _SECOND, start, way)
    for place in range(used):
        face = found[place]
        if _crossing(start, way, faces[face], points, normals[face]) >= 0.0:
            root = root_of(parent, place)
            odd[root] = not odd[root]
    for place in range(used):
        if parent[place] == place and odd[place] and not broken[place] and first_odd[place]:
            return SHUT
    return MET
