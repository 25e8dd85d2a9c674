"""A binary tree over boxes by the surface-area heuristic, in bins.

Goldsmith and Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing" (1987), for the
cost; Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies" (2007), for the bins.
Unlike there the planes between bins stand at multiples of powers of two, so that they stay where
they are when a box on the rim changes: the tree of all the others then mostly does, too.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

BINS = 16  # at least, over the longest edge; up to twice as many


@inline_kernel
def _half_area(low, high):
    """Half the surface of a box."""
    x = high[0] - low[0]
    y = high[1] - low[1]
    z = high[2] - low[2]
    return x * y + y * z + z * x


@inner_kernel
def _grow(low, high, lows, highs, i):
    for axis in range(3):
        low[axis] = min(low[axis], lows[i, axis])
        high[axis] = max(high[axis], highs[i, axis])


@inner_kernel
def _best_plane(lows, highs, order, begin, end, width, first, last):
    """(axis, bin) of the cheapest plane: what lies in bins up to it goes left; axis -1 for none.

    ``width``, ``first``, ``last`` (3,): edge of a bin, and the first and last bin in use.
    """
    best = np.inf
    best_axis = -1
    best_bin = 0
    counts = np.zeros(2 * BINS + 2, np.int64)
    bin_low = np.empty((2 * BINS + 2, 3))
    bin_high = np.empty((2 * BINS + 2, 3))
    right_cost = np.empty(2 * BINS + 2)
    low = np.empty(3)
    high = np.empty(3)
    for axis in range(3):
        bins = last[axis] - first[axis] + 1
        if bins < 2:
            continue
        counts[:bins] = 0
        bin_low[:bins] = np.inf
        bin_high[:bins] = -np.inf
        for place in range(begin, end):
            i = order[place]
            centre = 0.5 * lows[i, axis] + 0.5 * highs[i, axis]
            b = np.int64(np.floor(centre / width[axis])) - first[axis]
            counts[b] += 1
            _grow(bin_low[b], bin_high[b], lows, highs, i)
        low[:] = np.inf
        high[:] = -np.inf
        total = 0
        for b in range(bins - 1, 0, -1):
            if counts[b] > 0:
                _grow(low, high, bin_low, bin_high, b)
                total += counts[b]
            right_cost[b] = _half_area(low, high) * total if total > 0 else np.inf
        low[:] = np.inf
        high[:] = -np.inf
        total = 0
        for b in range(bins - 1):
            if counts[b] > 0:
                _grow(low, high, bin_low, bin_high, b)
                total += counts[b]
            if total > 0:
                cost = _half_area(low, high) * total + right_cost[b + 1]
                if cost < best:
                    best = cost
                    best_axis = axis
                    best_bin = first[axis] + b
    return best_axis, best_bin


@inner_kernel
def _lattice(lows, highs, order, begin, end, width, first, last):
    """Bins of the centres of some boxes: fills ``width``, ``first`` and ``last``."""
    for axis in range(3):
        low = np.inf
        high = -np.inf
        for place in range(begin, end):
            i = order[place]
            centre = 0.5 * lows[i, axis] + 0.5 * highs[i, axis]
            low = min(low, centre)
            high = max(high, centre)
        # So fine a lattice that its numbers are not exact would help nobody.
        step = max(high - low, 1e-12 * max(abs(low), abs(high))) / BINS
        first[axis] = 0
        last[axis] = 0
        width[axis] = 1.0
        if high > low and step > 0.0:
            width[axis] = 2.0 ** np.floor(np.log2(step))
            first[axis] = np.int64(np.floor(low / width[axis]))
            last[axis] = np.int64(np.floor(high / width[axis]))


@kernel("float64[:, :], float64[:, :], int64[:], int64[:], int64[:, :]")
def split_boxes(lows, highs, order, lefts, spans):
    """Number of nodes of a binary tree over boxes ``lows``, ``highs`` (n, 3), n at least 1.

    ``order``  (n,) int64, 0 to n - 1: comes back sorted, so that a node's boxes are neighbours.
    ``lefts``  (2 n - 1,) int64: left child of a node, the right one is next to it; -1 for a leaf,
               which holds one box.
    ``spans``  (2 n - 1, 2) int64: places in ``order`` that a node holds.

    Children come after their parent; node 0 is the root.
    """
    width = np.empty(3)
    first = np.empty(3, np.int64)
    last = np.empty(3, np.int64)
    moved = np.empty(len(order), np.int64)
    spans[0, 0] = 0
    spans[0, 1] = len(order)
    count = 1
    node = 0
    while node < count:
        begin = spans[node, 0]
        end = spans[node, 1]
        lefts[node] = -1
        if end - begin > 1:
            _lattice(lows, highs, order, begin, end, width, first, last)
            axis, plane = _best_plane(lows, highs, order, begin, end, width, first, last)
            middle = begin + (end - begin) // 2  # all in one place: halves
            if axis >= 0:
                middle = begin
                rest = 0
                for place in range(begin, end):
                    i = order[place]
                    centre = 0.5 * lows[i, axis] + 0.5 * highs[i, axis]
                    if np.int64(np.floor(centre / width[axis])) <= plane:
                        order[middle] = i
                        middle += 1
                    else:
                        moved[rest] = i
                        rest += 1
                order[middle:end] = moved[:rest]
            lefts[node] = count
            spans[count, 0] = begin
            spans[count, 1] = middle
            spans[count + 1, 0] = middle
            spans[count + 1, 1] = end
            count += 2
        node += 1
    return count


@kernel("float64[:, :], float64[:, :], int64[:], int64[:], int64[:, :], float64[:, :, :]")
def bound_nodes(lows, highs, order, lefts, spans, bounds):
    """Boxes (2 n - 1, 2, 3) of the nodes, from the leaves up."""
    for node in range(len(lefts) - 1, -1, -1):
        left = lefts[node]
        for axis in range(3):
            if left < 0:
                bounds[node, 0, axis] = lows[order[spans[node, 0]], axis]
                bounds[node, 1, axis] = highs[order[spans[node, 0]], axis]
            else:
                for side in range(2):
                    a = bounds[left, side, axis]
                    b = bounds[left + 1, side, axis]
                    bounds[node, side, axis] = min(a, b) if side == 0 else max(a, b)


@kernel("int64[:], int64, int64[:], int64[:], int64[:]")
def widen(lefts, most, first_children, child_counts, sources):
    """Number of nodes when neighbours share a parent, up to ``most`` children a node.

    From the leaves up, a binary node takes over the children of its two; where these are too many,
    the side with more of them stays a node of its own.  So few nodes are left with two or three.
    ``lefts`` as above; fills, breadth first, ``first_children``, ``child_counts`` (0 for a leaf)
    and ``sources``: the binary node that each stands for.
    """
    stays = np.zeros(len(lefts), np.bool_)
    taken = np.ones(len(lefts), np.int64)
    for node in range(len(lefts) - 1, -1, -1):
        left = lefts[node]
        if left < 0:
            stays[node] = True
            continue
        if taken[left] + taken[left + 1] > most:
            larger = left if taken[left] >= taken[left + 1] else left + 1
            stays[larger] = True
            taken[larger] = 1
        if taken[left] + taken[left + 1] > most:
            stays[left] = stays[left + 1] = True
            taken[left] = taken[left + 1] = 1
        taken[node] = taken[left] + taken[left + 1]
    sources[0] = 0
    count = 1
    node = 0
    open_nodes = np.empty(most + 1, np.int64)
    while node < count:
        first_children[node] = count
        waiting = 0
        left = lefts[sources[node]]
        if left >= 0:
            open_nodes[0] = left + 1
            open_nodes[1] = left
            waiting = 2
        while waiting > 0:
            waiting -= 1
            child = open_nodes[waiting]
            if stays[child]:
                sources[count] = child
                count += 1
            else:
                open_nodes[waiting] = lefts[child] + 1
                open_nodes[waiting + 1] = lefts[child]
                waiting += 2
        child_counts[node] = count - first_children[node]
        node += 1
    return count
