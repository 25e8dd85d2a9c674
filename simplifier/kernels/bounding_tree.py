"""A tree of bounding boxes over many small things, built in linear time after one sort.

The things are put in Morton order of their centres (Lauterbach et al., "Fast BVH Construction on
GPUs", 2009) and every ``leaf_size`` neighbours make a leaf of a complete binary tree in heap order:
node 1 is the root, the children of node i are 2 i and 2 i + 1, leaf j is node ``leaves`` + j.  It
needs no grid, so neither one huge triangle nor a far point costs more than its share.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compile import kernel
from simplifier.kernels.threads import run_chunks


def build_tree(
    lows: NDArray[np.float64], highs: NDArray[np.float64], leaf_size: int
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(nodes, order) over things with bounding boxes ``lows`` to ``highs``, (m, 3) each.

    ``nodes``  (2 * leaves, 6) float64: low and high corner; row 0 is unused; the box of an empty
               leaf is at infinity.  ``leaves`` is a power of two.
    ``order``  (m,) int64: leaf j holds things ``order[j * leaf_size : (j + 1) * leaf_size]``.

    m may be 0 and is below 2^32.
    """
    leaves = 1
    while leaves * leaf_size < len(lows):
        leaves *= 2
    nodes = np.full((2 * leaves, 6), np.inf)
    order = _morton_order(lows, highs)
    run_chunks(
        lambda begin, end: bound_leaves(lows, highs, order, leaf_size, begin, end, nodes), leaves
    )
    bound_parents(nodes)
    return nodes, order


def _morton_order(lows: NDArray[np.float64], highs: NDArray[np.float64]) -> NDArray[np.int64]:
    if len(lows) == 0:
        return np.zeros(0, dtype=np.int64)
    corner = np.empty(3)
    extent = box_corner(lows, highs, corner)
    scale = 1023.0 / extent if extent > 0.0 else 0.0
    keys = np.empty(len(lows), dtype=np.uint64)
    run_chunks(
        lambda begin, end: morton_keys(lows, highs, corner, scale, begin, end, keys), len(lows)
    )
    keys.sort()
    return (keys & np.uint64(0xFFFFFFFF)).astype(np.int64)


@kernel
def box_corner(lows, highs, corner):
    """Longest edge of the box around all; its low corner goes into ``corner``."""
    extent = 0.0
    for axis in range(3):
        low = np.inf
        high = -np.inf
        for i in range(lows.shape[0]):
            low = min(low, lows[i, axis])
            high = max(high, highs[i, axis])
        corner[axis] = low
        extent = max(extent, high - low)
    return extent


@kernel
def _spread_bits(value):
    """Bits 0..9 to every third place."""
    value = (value | (value << np.uint64(16))) & np.uint64(0x030000FF)
    value = (value | (value << np.uint64(8))) & np.uint64(0x0300F00F)
    value = (value | (value << np.uint64(4))) & np.uint64(0x030C30C3)
    return (value | (value << np.uint64(2))) & np.uint64(0x09249249)


@kernel
def morton_keys(lows, highs, corner, scale, begin, end, keys):
    """Morton code of each centre in the upper 32 bits, its number in the lower: no ties."""
    for i in range(begin, end):
        code = np.uint64(0)
        for axis in range(3):
            centre = 0.5 * lows[i, axis] + 0.5 * highs[i, axis]
            cell = np.uint64(min(max((centre - corner[axis]) * scale, 0.0), 1023.0))
            code |= _spread_bits(cell) << np.uint64(axis)
        keys[i] = (code << np.uint64(32)) | np.uint64(i)


@kernel
def bound_leaves(lows, highs, order, leaf_size, begin, end, nodes):
    """Boxes of leaves ``begin`` .. ``end - 1``; ``nodes`` starts as infinity."""
    leaves = nodes.shape[0] // 2
    for leaf in range(begin, end):
        node = leaves + leaf
        last = min((leaf + 1) * leaf_size, len(order))
        for place in range(leaf * leaf_size, last):
            i = order[place]
            for axis in range(3):
                if place == leaf * leaf_size:
                    nodes[node, axis] = lows[i, axis]
                    nodes[node, 3 + axis] = highs[i, axis]
                else:
                    nodes[node, axis] = min(nodes[node, axis], lows[i, axis])
                    nodes[node, 3 + axis] = max(nodes[node, 3 + axis], highs[i, axis])


@kernel
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


@kernel
def squared_distance_to_box(px, py, pz, nodes, node):
    """From a point to the closed box of a node; infinite for an empty leaf."""
    dx = max(nodes[node, 0] - px, px - nodes[node, 3], 0.0)
    dy = max(nodes[node, 1] - py, py - nodes[node, 4], 0.0)
    dz = max(nodes[node, 2] - pz, pz - nodes[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz
