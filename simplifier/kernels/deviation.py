"""Exact distances to a solid made of triangles and boxes, and the largest over other triangles.

A tree of bounding boxes over many small things, built in linear time after one sort.

The things are put in Morton order of their centres (Lauterbach et al., "Fast BVH Construction on
GPUs", 2009) and every ``leaf_size`` neighbours make a leaf of a complete binary tree in heap order:
node 1 is the root, the children of node i are 2 i and 2 i + 1, leaf j is node ``leaves`` + j.  It
needs no grid, so neither one huge triangle nor a far point costs more than its share.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.threads import run_chunks

_LEAST_OF_LEAF = 4  # triangles, where there are as many

_TREE_DEPTH = (
    64  # entries of a search's stack; a tree over fewer than 2^32 things is at most 33 deep
)

_SLIVER = 1e-15
"""Square of a triangle's height over its longest edge, from which its normal has more digits than
the edges lack: each is off by some 3e-8 of that edge there."""

_ROUNDING = 1e-9  # of the slack: what rounding adds to the distance from a triangle to itself


@kernel("float64[:, :], int32[:, :], int64[:], float64[:, :], float64[:, :]")
def triangle_boxes(points, faces, chosen, lows, highs):
    """Bounding boxes of the triangles ``chosen`` (n,) by number into (n, 3) float64 arrays."""
    for place in range(len(chosen)):
        face = chosen[place]
        for axis in range(3):
            a = points[faces[face, 0], axis]
            b = points[faces[face, 1], axis]
            c = points[faces[face, 2], axis]
            lows[place, axis] = min(a, b, c)
            highs[place, axis] = max(a, b, c)


@inner_kernel
def _squared_to_segment(ax, ay, az, ex, ey, ez):
    """From the origin to the segment a .. a + e, of any length."""
    length = ex * ex + ey * ey + ez * ez
    t = 0.0
    if length > 0.0:
        t = min(max(-(ax * ex + ay * ey + az * ez) / length, 0.0), 1.0)
    x = ax + t * ex
    y = ay + t * ey
    z = az + t * ez
    return x * x + y * y + z * z


@inner_kernel
def squared_distance_to_triangle(px, py, pz, a, b, c):
    """From a point to the closed triangle with corners ``a``, ``b``, ``c`` ((3,) float64 each).

    The least over the three edges, or the distance to the plane where the foot of the perpendicular
    lies inside; slivers fall back on their edges, which stay exact.
    """
    ax, ay, az = a[0] - px, a[1] - py, a[2] - pz
    bx, by, bz = b[0] - px, b[1] - py, b[2] - pz
    cx, cy, cz = c[0] - px, c[1] - py, c[2] - pz
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - bx, cy - by, cz - bz
    wx, wy, wz = ax - cx, ay - cy, az - cz
    nx = uy * vz - uz * vy
    ny = uz * vx - ux * vz
    nz = ux * vy - uy * vx
    # The foot is inside when it is left of every edge: sign of n . (edge x (foot - corner)).
    in_u = nx * (ay * uz - az * uy) + ny * (az * ux - ax * uz) + nz * (ax * uy - ay * ux)
    in_v = nx * (by * vz - bz * vy) + ny * (bz * vx - bx * vz) + nz * (bx * vy - by * vx)
    in_w = nx * (cy * wz - cz * wy) + ny * (cz * wx - cx * wz) + nz * (cx * wy - cy * wx)
    square = nx * nx + ny * ny + nz * nz
    if square > 0.0 and in_u >= 0.0 and in_v >= 0.0 and in_w >= 0.0:
        longest = max(
            ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
        )
        if square > _SLIVER * longest * longest:
            height = ax * nx + ay * ny + az * nz
            return height * height / square
    best = _squared_to_segment(ax, ay, az, ux, uy, uz)
    best = min(best, _squared_to_segment(bx, by, bz, vx, vy, vz))
    return min(best, _squared_to_segment(cx, cy, cz, wx, wy, wz))


@inner_kernel
def _nearest_squared(px, py, pz, nodes, order, points, faces, best, stop, enough, stack, keys):
    """Least of ``best`` and the squared distance to the nearest thing of a tree.

    With ``faces`` of no rows the things are the boxes of the leaves themselves (leaf size 1), else
    triangles, :func:`triangles_of_leaf` a leaf.  Exact when above ``enough``; else an upper bound,
    and ``stop`` or less when the exact value is.  In the middle of a round limb thousands of
    triangles are nearly as near as the nearest: telling them apart is most of the cost, and only
    a new record needs it.  ``stack``, ``keys`` are scratch.  Returns that and the triangle that it
    is the distance to, -1 for a box or what ``best`` was.
    """
    nearest = -1
    leaves = nodes.shape[0] // 2
    node, key, top = 1, squared_distance_to_box(px, py, pz, nodes, 1), 0
    while best > stop:
        if key >= best or (best <= enough and key > stop):
            if top == 0:
                break
            top -= 1
            node, key = stack[np.uint64(top)], keys[np.uint64(top)]
            continue
        if node >= leaves:
            if faces.shape[0] == 0:
                best = key
                continue
            size = (len(order) + leaves - 1) // leaves
            first = (node - leaves) * size
            for place in range(first, min(first + size, len(order))):
                face = order[np.uint64(place)]
                a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
                distance = squared_distance_to_triangle(px, py, pz, points[a], points[b], points[c])
                if distance < best:
                    best, nearest = distance, face
            key = np.inf
            continue
        near = 2 * node
        far = near + 1
        key = squared_distance_to_box(px, py, pz, nodes, near)
        far_key = squared_distance_to_box(px, py, pz, nodes, far)
        if far_key < key:
            near, far = far, near
            key, far_key = far_key, key
        if far_key < best:
            stack[np.uint64(top)], keys[np.uint64(top)] = far, far_key
            top += 1
        node = near
    return best, nearest


@inner_kernel
def _squared(bound):
    return bound * bound if bound >= 0.0 else -1.0


@inner_kernel
def _distance(px, py, pz, stop, enough, box_nodes, nodes, order, points, faces, stack, keys):
    """To the boxes or the triangles, whichever is nearer, and which triangle; else -1.

    Exact when above ``enough``.  ``stop`` and ``enough`` as in :func:`_nearest_squared`, not
    squared; negative: never.
    """
    s = _squared(stop)
    e = _squared(enough)
    best = np.inf
    best, _ = _nearest_squared(
        px, py, pz, box_nodes, order, points, faces[:0], best, s, e, stack, keys
    )
    best, face = _nearest_squared(px, py, pz, nodes, order, points, faces, best, s, e, stack, keys)
    return np.sqrt(best), face


@kernel(
    "float64[:, :], float64[:, :], float64[:, :], int64[:], float64[:, :], int32[:, :], int64, "
    "int64, float64[:]"
)
def point_distances(queries, box_nodes, nodes, order, points, faces, begin, end, distances):
    """Exact distances of ``queries[begin:end]`` to boxes and triangles, into (n,) float64."""
    stack = np.empty(_TREE_DEPTH, np.int64)
    keys = np.empty(_TREE_DEPTH)
    for i in range(begin, end):
        x, y, z = queries[i]
        distances[i], _ = _distance(
            x, y, z, -1.0, -1.0, box_nodes, nodes, order, points, faces, stack, keys
        )


@kernel(
    "float64[:, :, :], float64, float64, float64[:, :], float64[:, :], int64[:], float64[:, :], "
    "int32[:, :], int64, int64, float64[:], float64[:]"
)
def piece_distances(
    pieces, largest, slack, box_nodes, nodes, order, points, faces, begin, end, distances, reaches
):
    """Distance of the centroid, and reach, of each of ``pieces[begin:end]`` (n, 3, 3).

    The reach is the distance from the centroid to the furthest corner, so no point of the piece is
    further away than distance + reach.  With stop = ``largest`` + ``slack`` - reach: the result is
    at most stop where the distance is; it is the distance where that is above both stop and
    ``largest``; else it is an upper bound.

    Nor is any point further from one triangle than the furthest corner is, as the distance to a
    convex set is a convex function.  Where that tells that the piece holds no record, the reach is
    0 and the distance at most ``largest``: a piece on a large flat triangle need not be cut up.
    """
    stack = np.empty(_TREE_DEPTH, np.int64)
    keys = np.empty(_TREE_DEPTH)
    for i in range(begin, end):
        x = (pieces[i, 0, 0] + pieces[i, 1, 0] + pieces[i, 2, 0]) / 3.0
        y = (pieces[i, 0, 1] + pieces[i, 1, 1] + pieces[i, 2, 1]) / 3.0
        z = (pieces[i, 0, 2] + pieces[i, 1, 2] + pieces[i, 2, 2]) / 3.0
        square = 0.0
        for corner in range(3):
            dx = pieces[i, corner, 0] - x
            dy = pieces[i, corner, 1] - y
            dz = pieces[i, corner, 2] - z
            square = max(square, dx * dx + dy * dy + dz * dz)
        reaches[i] = np.sqrt(square)
        stop = largest + slack - reaches[i]
        distances[i], face = _distance(
            x, y, z, stop, largest, box_nodes, nodes, order, points, faces, stack, keys
        )
        if face >= 0 and distances[i] > stop:
            bound = _furthest_corner(pieces[i], points, faces[face])
            if bound <= largest + _ROUNDING * slack:
                distances[i] = min(bound, largest)
                reaches[i] = 0.0


@inner_kernel
def _furthest_corner(piece, points, face):
    """Largest distance of the corners of a (3, 3) piece from a triangle."""
    a, b, c = points[face[0]], points[face[1]], points[face[2]]
    square = 0.0
    for corner in range(3):
        x, y, z = piece[corner]
        square = max(square, squared_distance_to_triangle(x, y, z, a, b, c))
    return np.sqrt(square)


@kernel("float64[:, :, :], float64[:, :, :]")
def halve_pieces(pieces, halves):
    """Cut each piece at the middle of its longest edge: (n, 3, 3) to (2 n, 3, 3)."""
    for i in range(pieces.shape[0]):
        longest = -1.0
        first = 0
        for corner in range(3):
            after = (corner + 1) % 3
            length = 0.0
            for axis in range(3):
                step = pieces[i, after, axis] - pieces[i, corner, axis]
                length += step * step
            if length > longest:
                longest = length
                first = corner
        second = (first + 1) % 3
        for axis in range(3):
            for corner in range(3):
                halves[2 * i, corner, axis] = pieces[i, corner, axis]
                halves[2 * i + 1, corner, axis] = pieces[i, corner, axis]
            middle = 0.5 * pieces[i, first, axis] + 0.5 * pieces[i, second, axis]
            halves[2 * i, second, axis] = middle
            halves[2 * i + 1, first, axis] = middle


def triangles_of_leaf(count: int) -> int:
    """How many of so many triangles make a leaf, 4 to 8: as many as fill a tree whose leaves are a
    power of two, since empty ones take memory as well."""
    leaves = 1
    while 2 * leaves * _LEAST_OF_LEAF <= count:
        leaves *= 2
    return max(-(-count // leaves), 1)


Boxes = Callable[[NDArray[np.int64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Low and high corners, (n, 3) each, of the bounding boxes of things by their numbers (n,)."""

_BLOCK = 1 << 14
"""Boxes that there are at once: those of all things would take more memory than the tree."""


def build_box_tree(
    boxes: Boxes, count: int, leaf_size: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(nodes, order) over ``count`` things with bounding boxes.

    ``nodes``  (2 * leaves, 6) float64: low and high corner; row 0 is unused; the box of an empty
               leaf is at infinity.  ``leaves`` is a power of two.
    ``order``  (count,) int64: leaf j holds things ``order[j * leaf_size : (j + 1) * leaf_size]``.

    The count may be 0 and is below 2^32.
    """
    leaves = 1
    while leaves * leaf_size < count:
        leaves *= 2
    nodes = np.full((2 * leaves, 6), np.inf)
    order = _morton_order(boxes, count)

    def bound(begin: int, end: int) -> None:
        for first, last in _blocks(begin, end, _BLOCK // leaf_size):
            lows, highs = boxes(order[first * leaf_size : last * leaf_size])
            bound_leaves(lows, highs, leaf_size, leaves + first, nodes)

    run_chunks(bound, leaves)
    bound_parents(nodes)
    return nodes, order


def _blocks(begin: int, end: int, most: int) -> Iterator[tuple[int, int]]:
    for first in range(begin, end, most):
        yield first, min(first + most, end)


def _morton_order(boxes: Boxes, count: int) -> NDArray[np.int64]:
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    ends: list[NDArray[np.float64]] = []

    def look(begin: int, end: int) -> None:
        around = np.array([[np.inf] * 3, [-np.inf] * 3])
        for first, last in _blocks(begin, end, _BLOCK):
            widen_box(*boxes(np.arange(first, last)), around)
        ends.append(around)

    run_chunks(look, count)
    corner = np.min(ends, axis=0)[0]
    extent = float((np.max(ends, axis=0)[1] - corner).max())
    scale = 1023.0 / extent if extent > 0.0 else 0.0
    keys = np.empty(count, dtype=np.uint64)

    def number(begin: int, end: int) -> None:
        for first, last in _blocks(begin, end, _BLOCK):
            morton_keys(*boxes(np.arange(first, last)), corner, scale, first, keys)

    run_chunks(number, count)
    keys.sort()
    keys &= np.uint64(0xFFFFFFFF)
    return keys.view(np.int64)


@kernel("float64[:, :], float64[:, :], float64[:, :]")
def widen_box(lows, highs, around):
    """Widen a box, low and high corner (2, 3), so that all lie in it."""
    for i in range(len(lows)):
        for axis in range(3):
            around[0, axis] = min(around[0, axis], lows[i, axis])
            around[1, axis] = max(around[1, axis], highs[i, axis])


@inner_kernel
def _spread_bits(value):
    """Bits 0..9 to every third place."""
    value = (value | (value << np.uint64(16))) & np.uint64(0x030000FF)
    value = (value | (value << np.uint64(8))) & np.uint64(0x0300F00F)
    value = (value | (value << np.uint64(4))) & np.uint64(0x030C30C3)
    return (value | (value << np.uint64(2))) & np.uint64(0x09249249)


@kernel("float64[:, :], float64[:, :], float64[:], float64, int64, uint64[:]")
def morton_keys(lows, highs, corner, scale, first, keys):
    """Morton code of each centre in the upper 32 bits, its number in the lower: no ties.

    The boxes are those of the things from number ``first`` on, as are the ``keys`` written.
    """
    for i in range(len(lows)):
        code = np.uint64(0)
        for axis in range(3):
            centre = 0.5 * lows[i, axis] + 0.5 * highs[i, axis]
            cell = np.uint64(min(max((centre - corner[axis]) * scale, 0.0), 1023.0))
            code |= _spread_bits(cell) << np.uint64(axis)
        keys[first + i] = (code << np.uint64(32)) | np.uint64(first + i)


@kernel("float64[:, :], float64[:, :], int64, int64, float64[:, :]")
def bound_leaves(lows, highs, leaf_size, first, nodes):
    """Boxes of the leaves from node ``first`` on, which hold things with these boxes in turn.

    ``nodes`` starts as infinity.
    """
    for i in range(len(lows)):
        node = first + i // leaf_size
        for axis in range(3):
            if i % leaf_size == 0:
                nodes[node, axis] = lows[i, axis]
                nodes[node, 3 + axis] = highs[i, axis]
            else:
                nodes[node, axis] = min(nodes[node, axis], lows[i, axis])
                nodes[node, 3 + axis] = max(nodes[node, 3 + axis], highs[i, axis])


@kernel("float64[:, :]")
def bound_parents(nodes):
    """Boxes of the inner nodes from those of their children."""
    for node in range(nodes.shape[0] // 2 - 1, 0, -1):
        left = 2 * node
        right = left + 1
        for axis in range(3):
            nodes[node, axis] = min(nodes[left, axis], nodes[right, axis])
            if nodes[right, 0] == np.inf:
                nodes[node, 3 + axis] = nodes[left, 3 + axis]
            else:
                nodes[node, 3 + axis] = max(nodes[left, 3 + axis], nodes[right, 3 + axis])


@inner_kernel
def squared_distance_to_box(px, py, pz, nodes, node):
    """From a point to the closed box of a node; infinite for an empty leaf."""
    row = np.uint64(node)
    dx = max(nodes[row, 0] - px, px - nodes[row, 3], 0.0)
    dy = max(nodes[row, 1] - py, py - nodes[row, 4], 0.0)
    dz = max(nodes[row, 2] - pz, pz - nodes[row, 5], 0.0)
    return dx * dx + dy * dy + dz * dz
