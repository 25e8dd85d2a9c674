"""Search for the cut with the largest occlusion measure within a budget of triangles.

Arrays as in :mod:`simplifier.kernels.measure`.  A *pair* is a polygon at one level, and what
it costs is the triangles that it adds.  A search is one thread's work from begin to end, and lazy:
a pair is scored again only when it comes to the top, and on a quarter of the views first.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import measure_twice
from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.measure import draw_polygon, draw_ring, gather_ring

_STRIDE = 4  # a coarse score looks at every fourth view
_DOUBT = 0.75  # and may fall short of the true one by this factor
_BLOCK = 32  # pairs, of which the best is known
_SHORTLIST = 16  # polygons whose levels are scored in full after something was taken out


@inner_kernel
def _gain(shapes, polygon, level, union, view_scores, first, stride, scratch):
    """What a pair adds to the score of the union, over every ``stride``-th view from ``first``."""
    points, lowest, offsets, maps = shapes
    ring, image = scratch
    count = gather_ring(points, lowest, offsets[polygon], offsets[polygon + 1], level, ring)
    gain = np.int64(0)
    for view in range(first, union.shape[0], stride):
        draw_ring(ring, count, maps[polygon, view], image)
        new = np.uint64(0)
        for row in range(64):
            new |= image[row] & ~union[view, row]
            image[row] |= union[view, row]
        if new != 0:
            gain += measure_twice(image) - view_scores[view]
    return gain


@inner_kernel
def _refresh_gain(shapes, polygon, level, union, view_scores, weight, bar, scratch):
    """The gain of a pair and whether it is exact: False when weighted it is sure to miss ``bar``.

    A quarter of the views tells most pairs; what they promise is then raised by the doubt.  The
    worth is the caller's to the last bit: rounded otherwise, a pair could be turned down here and
    still be the best there, for ever.
    """
    gain = _gain(shapes, polygon, level, union, view_scores, 0, _STRIDE, scratch)
    promise = np.int64(_STRIDE * gain / _DOUBT)
    if promise * weight < bar:
        return promise, False
    for first in range(1, _STRIDE):
        gain += _gain(shapes, polygon, level, union, view_scores, first, _STRIDE, scratch)
    return gain, True


@inner_kernel
def _unite(shapes, standing, taken, drawn, images, union, view_scores):
    """Rebuild union and scores from what stands and the members; redraw where a level changed."""
    points, lowest, offsets, maps = shapes
    views = union.shape[0]
    for view in range(views):
        for row in range(64):
            union[view, row] = standing[view, row]
    for polygon in range(len(taken)):
        if taken[polygon] > 0:
            if drawn[polygon] != taken[polygon]:
                draw_polygon(
                    points, lowest, offsets, maps, polygon, taken[polygon], images[polygon]
                )
                drawn[polygon] = taken[polygon]
            for view in range(views):
                for row in range(64):
                    union[view, row] |= images[polygon, view, row]
    total = np.int64(0)
    for view in range(views):
        view_scores[view] = measure_twice(union[view])
        total += view_scores[view]
    return total


@inner_kernel
def _weigh_pairs(pairs, gains, taken, left, weights, worths):
    """Fill ``worths`` (k,): what each pair gains, weighted by what it costs; 0 where it adds
    nothing, or too much."""
    polygons, levels, _ = pairs
    for pair in range(len(polygons)):
        cost = levels[pair] - taken[polygons[pair]]
        fits = cost > 0 and cost <= left
        worths[pair] = gains[pair] * weights[cost] if fits else 0.0


@inner_kernel
def _find_peak(worths, block, peaks):
    """Write the largest worth of a block of pairs."""
    most = 0.0
    for pair in range(block * _BLOCK, min((block + 1) * _BLOCK, len(worths))):
        most = max(most, worths[pair])
    peaks[block] = most


@inner_kernel
def _rank(pairs, gains, fresh, taken, left, weights, worths, peaks):
    """Weigh all pairs, and find the best of each block; return the best worth of those whose gain
    is ``fresh``: no other needs to beat more."""
    _weigh_pairs(pairs, gains, taken, left, weights, worths)
    for block in range(len(peaks)):
        _find_peak(worths, block, peaks)
    bar = 0.0
    for pair in range(len(fresh)):
        if fresh[pair]:
            bar = max(bar, worths[pair])
    return bar


@inner_kernel
def _best_pair(worths, peaks):
    """The first pair of the largest worth; -1 where none is worth anything."""
    most, block = 0.0, -1
    for other in range(len(peaks)):
        if peaks[other] > most:
            most, block = peaks[other], other
    if block < 0:
        return -1
    pair = block * _BLOCK
    while worths[pair] != most:
        pair += 1
    return pair


@inner_kernel
def _fill(
    shapes, standing, pairs, gains, taken, drawn, images, union, view_scores, limits, scratch, halt,
):  # fmt: skip
    """Add the pair with the best gain a triangle until budget, alpha or ``halt`` ends it.

    ``gains`` (k,) int64 bounds what each pair gains; -1 for pairs that are not looked at.
    """
    polygons, levels, _ = pairs
    budget, alpha, weights = limits
    total = np.sum(view_scores)
    fresh = np.zeros(len(polygons), np.bool_)
    worths = np.empty(len(polygons))
    peaks = np.empty((len(polygons) + _BLOCK - 1) // _BLOCK)
    left = budget - np.sum(taken)
    bar = _rank(pairs, gains, fresh, taken, left, weights, worths, peaks)
    while left > 0 and not halt[0]:
        best = _best_pair(worths, peaks)
        if best < 0:
            break
        polygon, level = polygons[best], levels[best]
        before = taken[polygon]
        if not fresh[best]:
            weight = weights[level - before]
            gains[best], fresh[best] = _refresh_gain(
                shapes, polygon, level, union, view_scores, weight, bar, scratch
            )
            worths[best] = gains[best] * weight
            _find_peak(worths, best // _BLOCK, peaks)
            if fresh[best]:
                bar = max(bar, worths[best])
            continue
        if gains[best] < alpha * total:
            break
        taken[polygon] = level
        after = _unite(shapes, standing, taken, drawn, images, union, view_scores)
        if after <= total:  # another level that uncovers as much as it covers
            taken[polygon] = before
            gains[best] = -1
            _unite(shapes, standing, taken, drawn, images, union, view_scores)
        else:
            left -= level - before
            total = after
            fresh[:] = False
        bar = _rank(pairs, gains, fresh, taken, left, weights, worths, peaks)
    return total


@inner_kernel
def _shortlist(shapes, pairs, triangles, gains, union, view_scores, left, scratch):
    """Let :func:`_fill` look at the most promising polygons only, by a coarse score."""
    _, _, firsts = pairs
    coarse = np.zeros(len(triangles), np.int64)
    for polygon in range(len(triangles)):
        level = min(triangles[polygon], left)
        coarse[polygon] = _gain(shapes, polygon, level, union, view_scores, 0, _STRIDE, scratch)
    for pair in range(len(gains)):
        gains[pair] = -1
    for _ in range(min(_SHORTLIST, len(triangles))):
        best = np.argmax(coarse)
        for pair in range(firsts[best], firsts[best + 1]):
            gains[pair] = np.int64(_STRIDE * coarse[best] / _DOUBT)
        coarse[best] = -1


@inner_kernel
def _drop_member(taken, index):
    """Take out the member with that many members before it."""
    for polygon in range(len(taken)):
        if taken[polygon] > 0:
            if index == 0:
                taken[polygon] = 0
                return
            index -= 1


@kernel(
    "float64[:, :], int32[:], int64[:], float64[:, :, :], int32[:], int32[:], int32[:], "
    "int64[:], (int64, float64, float64[:]), int64, int64, uint8[:], uint64[:, :], int64[:]"
)
def search_cut(
    points, lowest, offsets, maps, triangles, polygons, levels, firsts, limits, exchanges, seed,
    halt, standing, bounds,
):  # fmt: skip
    """Fill the budget by gain a triangle, then take members out and refill while that helps.

    ``triangles`` (p,) int32 full triangle counts; ``polygons``, ``levels`` (k,) int32 the pairs,
    those of polygon i from ``firsts[i]`` to ``firsts[i + 1]`` (p + 1,) int64.  ``limits`` are the
    budget, the least gain worth a pair as a share of the score, and (budget + 1,) float64 weights
    of a gain by what it costs (1 / cost: gain a triangle).  ``exchanges`` is how often two members
    are taken out and the freed triangles spent anew; ``seed`` chooses the second of the two.

    ``standing`` (V, 64) uint64 is what is hidden already, at no cost; ``bounds`` (p,) int64 is what
    each polygon adds to that in full, and so at most at any level.

    ``halt`` (1,) uint8 ends the search early, with a cut of no worth, once another thread sets it.
    Returns the levels (p,) int32 and the score.
    """
    shapes = (points, lowest, offsets, maps)
    pairs = (polygons, levels, firsts)
    count = len(triangles)
    views = maps.shape[1]
    scratch = np.empty((np.max(triangles) + 2, 2)), np.zeros(64, np.uint64)
    taken = np.zeros(count, np.int32)
    drawn = np.zeros(count, np.int32)
    images = np.empty((count, views, 64), np.uint64)
    union = np.zeros((views, 64), np.uint64)
    view_scores = np.zeros(views, np.int64)
    gains = np.empty(len(polygons), np.int64)
    _unite(shapes, standing, taken, drawn, images, union, view_scores)
    for polygon in range(count):
        for pair in range(firsts[polygon], firsts[polygon + 1]):
            gains[pair] = bounds[polygon]
    total = _fill(
        shapes, standing, pairs, gains, taken, drawn, images, union, view_scores, limits,
        scratch, halt,
    )  # fmt: skip
    kept = taken.copy()
    state = np.uint64(seed)
    for exchange in range(exchanges):
        members = 0
        for polygon in range(count):
            members += taken[polygon] > 0
        if members == 0 or halt[0]:
            break
        state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        _drop_member(taken, exchange % members)
        if members > 1:
            _drop_member(taken, np.int64(state >> np.uint64(33)) % (members - 1))
        _unite(shapes, standing, taken, drawn, images, union, view_scores)
        left = limits[0] - np.sum(taken)
        _shortlist(shapes, pairs, triangles, gains, union, view_scores, left, scratch)
        trial = _fill(
            shapes, standing, pairs, gains, taken, drawn, images, union, view_scores, limits,
            scratch, halt,
        )  # fmt: skip
        if trial > total:
            total = trial
            for polygon in range(count):
                kept[polygon] = taken[polygon]
        else:
            for polygon in range(count):
                taken[polygon] = kept[polygon]
    return kept, total
