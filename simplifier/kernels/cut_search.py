"""Search for the cut with the largest occlusion measure within a budget of triangles.

Arrays as in :mod:`simplifier.kernels.polygon_views`.  A *pair* is a polygon at one level, and what
it costs is the triangles that it adds.  A search is one thread's work from begin to end, and lazy:
a pair is scored again only when it comes to the top, and view by view only until it is clear that
it cannot stay there.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import measure_twice
from simplifier.kernels.compile import kernel
from simplifier.kernels.polygon_views import draw_ring, gather_ring

_STRIDE = 4  # while ranking polygons, every fourth view is looked at
_SHORTLIST = 16  # polygons whose levels are scored in full after something was taken out


@kernel
def _view_gain(ring, count, matrix, union, view, view_scores, here, there):
    """What a ring adds to the score of one view."""
    draw_ring(ring, count, matrix, here)
    new = np.uint64(0)
    for row in range(64):
        new |= here[row + 1] & ~union[view, row]
        here[row + 1] |= union[view, row]
    if new == 0:
        return np.int64(0)
    return measure_twice(here, there) - view_scores[view]


@kernel
def _gains_of(shapes, polygon, level, union, view_scores, stride, scratch, view_gains):
    """Write what a pair adds to every ``stride``-th view; return the sum."""
    points, lowest, offsets, maps = shapes
    ring, here, there = scratch
    count = gather_ring(points, lowest, offsets[polygon], offsets[polygon + 1], level, ring)
    total = np.int64(0)
    for view in range(0, union.shape[0], stride):
        gain = _view_gain(ring, count, maps[polygon, view], union, view, view_scores, here, there)
        view_gains[view] = gain
        total += gain
    return total


@kernel
def _refreshed(shapes, polygon, level, union, view_scores, scratch, view_gains, gain, least):
    """Bring a pair's gains up to date, view by view, until their sum falls below ``least``.

    ``view_gains`` are upper bounds from earlier scores, ``gain`` their sum.  Returns the new sum
    and whether every view was looked at.
    """
    points, lowest, offsets, maps = shapes
    ring, here, there = scratch
    count = gather_ring(points, lowest, offsets[polygon], offsets[polygon + 1], level, ring)
    for view in range(union.shape[0]):
        now = _view_gain(ring, count, maps[polygon, view], union, view, view_scores, here, there)
        gain += now - view_gains[view]
        view_gains[view] = now
        if gain < least:
            return gain, False
    return gain, True


@kernel
def _draw_member(shapes, polygon, level, images, scratch):
    points, lowest, offsets, maps = shapes
    ring, here, _ = scratch
    count = gather_ring(points, lowest, offsets[polygon], offsets[polygon + 1], level, ring)
    for view in range(images.shape[1]):
        draw_ring(ring, count, maps[polygon, view], here)
        for row in range(64):
            images[polygon, view, row] = here[row + 1]


@kernel
def _unite(shapes, taken, drawn, images, union, view_scores, scratch):
    """Rebuild union and scores from the members; redraw those whose level changed."""
    _, here, there = scratch
    views = union.shape[0]
    for view in range(views):
        for row in range(64):
            union[view, row] = 0
    for polygon in range(len(taken)):
        if taken[polygon] > 0:
            if drawn[polygon] != taken[polygon]:
                _draw_member(shapes, polygon, taken[polygon], images, scratch)
                drawn[polygon] = taken[polygon]
            for view in range(views):
                for row in range(64):
                    union[view, row] |= images[polygon, view, row]
    total = np.int64(0)
    for view in range(views):
        for row in range(64):
            here[row + 1] = union[view, row]
        view_scores[view] = measure_twice(here, there)
        total += view_scores[view]
    return total


@kernel
def _fill(
    shapes, pairs, gains, view_gains, taken, drawn, images, union, view_scores, limits, scratch
):
    """Add the pair with the best gain a triangle until budget or alpha ends it.

    ``gains`` (k,) bounds what each pair gains, the sum of its ``view_gains`` (k, views); -1 for
    pairs that are not looked at.
    """
    polygons, levels, _ = pairs
    budget, alpha, weights = limits
    total = np.sum(view_scores)
    fresh = np.zeros(len(polygons), np.bool_)
    left = budget - np.sum(taken)
    while left > 0:
        # The best pair, and the best of those that are up to date: no other needs to beat more.
        best = -1
        best_worth = 0.0
        bar = 0.0
        for pair in range(len(polygons)):
            cost = levels[pair] - taken[polygons[pair]]
            if cost > 0 and cost <= left:
                worth = gains[pair] * weights[cost]
                if worth > best_worth:
                    best = pair
                    best_worth = worth
                if worth > bar and fresh[pair]:
                    bar = worth
        if best < 0:
            break
        polygon, level = polygons[best], levels[best]
        before = taken[polygon]
        if not fresh[best]:
            gains[best], fresh[best] = _refreshed(
                shapes, polygon, level, union, view_scores, scratch,
                view_gains[best], gains[best], bar / weights[level - before],
            )  # fmt: skip
            continue
        if gains[best] < alpha * total:
            break
        taken[polygon] = level
        after = _unite(shapes, taken, drawn, images, union, view_scores, scratch)
        if after <= total:  # another level that uncovers as much as it covers
            taken[polygon] = before
            gains[best] = -1
            _unite(shapes, taken, drawn, images, union, view_scores, scratch)
            continue
        left -= level - before
        total = after
        for pair in range(len(fresh)):
            fresh[pair] = False
    return total


@kernel
def _shortlist(shapes, pairs, triangles, gains, view_gains, union, view_scores, left, scratch):
    """Let :func:`_fill` look at the most promising polygons only, by a coarse score."""
    _, _, firsts = pairs
    views = union.shape[0]
    bounds = np.empty(views, np.int32)
    coarse = np.zeros(len(triangles), np.int64)
    for polygon in range(len(triangles)):
        level = min(triangles[polygon], left)
        coarse[polygon] = _gains_of(
            shapes, polygon, level, union, view_scores, _STRIDE, scratch, bounds
        )
    for pair in range(len(gains)):
        gains[pair] = -1
    for _ in range(min(_SHORTLIST, len(triangles))):
        best = np.argmax(coarse)
        coarse[best] = -1
        _bound_levels(
            shapes, best, triangles, firsts, gains, view_gains, union, view_scores, scratch
        )


@kernel
def _bound_levels(
    shapes, polygon, triangles, firsts, gains, view_gains, union, view_scores, scratch
):
    """A level lies in its full polygon, so in no view it gains more than that."""
    first = firsts[polygon]
    total = _gains_of(
        shapes, polygon, triangles[polygon], union, view_scores, 1, scratch, view_gains[first]
    )
    for pair in range(first, firsts[polygon + 1]):
        gains[pair] = total
        for view in range(union.shape[0]):
            view_gains[pair, view] = view_gains[first, view]


@kernel
def _drop_member(taken, index):
    """Take out the member with that many members before it."""
    for polygon in range(len(taken)):
        if taken[polygon] > 0:
            if index == 0:
                taken[polygon] = 0
                return
            index -= 1


@kernel
def search_cut(
    points, lowest, offsets, maps, triangles, polygons, levels, firsts, limits, exchanges, seed
):
    """Fill the budget by gain a triangle, then take members out and refill while that helps.

    ``triangles`` (p,) int32 full triangle counts; ``polygons``, ``levels`` (k,) int32 the pairs,
    those of polygon i from ``firsts[i]`` to ``firsts[i + 1]`` (p + 1,) int64.  ``limits`` are the
    budget, the least gain worth a pair as a share of the score, and (budget + 1,) float64 weights
    of a gain by what it costs (1 / cost: gain a triangle).  ``exchanges`` is how often two members
    are taken out and the freed triangles spent anew; ``seed`` chooses the second of the two.

    Returns the levels (p,) int32 and the score.
    """
    shapes = (points, lowest, offsets, maps)
    pairs = (polygons, levels, firsts)
    count = len(triangles)
    views = maps.shape[1]
    scratch = (
        np.empty((np.max(triangles) + 2, 2)),
        np.zeros(66, np.uint64),
        np.zeros(66, np.uint64),
    )
    taken = np.zeros(count, np.int32)
    drawn = np.zeros(count, np.int32)
    images = np.empty((count, views, 64), np.uint64)
    union = np.zeros((views, 64), np.uint64)
    view_scores = np.zeros(views, np.int64)
    gains = np.empty(len(polygons), np.int64)
    view_gains = np.empty((len(polygons), views), np.int32)
    for polygon in range(count):
        _bound_levels(
            shapes, polygon, triangles, firsts, gains, view_gains, union, view_scores, scratch
        )
    total = _fill(
        shapes, pairs, gains, view_gains, taken, drawn, images, union, view_scores, limits, scratch
    )
    kept = taken.copy()
    state = np.uint64(seed)
    for exchange in range(exchanges):
        members = 0
        for polygon in range(count):
            members += taken[polygon] > 0
        if members == 0:
            break
        state = state * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
        _drop_member(taken, exchange % members)
        if members > 1:
            _drop_member(taken, np.int64(state >> np.uint64(33)) % (members - 1))
        _unite(shapes, taken, drawn, images, union, view_scores, scratch)
        left = limits[0] - np.sum(taken)
        _shortlist(shapes, pairs, triangles, gains, view_gains, union, view_scores, left, scratch)
        trial = _fill(
            shapes, pairs, gains, view_gains, taken, drawn, images, union, view_scores, limits,
            scratch,
        )  # fmt: skip
        if trial > total:
            total = trial
            for polygon in range(count):
                kept[polygon] = taken[polygon]
        else:
            for polygon in range(count):
                taken[polygon] = kept[polygon]
    return kept, total
