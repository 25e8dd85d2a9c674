"""Anneal the triangles of an occluder: random moves that raise its score inside a room.

Arrays as in :mod:`simplifier.kernels.soup_views`; ``scores`` (V,) int64 is what each view scores.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.soup_views import (
    BLOCK,
    all_but_one,
    corner,
    draw_found,
    draw_front,
    exchange_picture,
    find_edges,
    put_projection,
    score_view,
)
from simplifier.kernels.voxelize import is_contained

TRIES = 6
"""Moves tried at a triangle before another is drawn; they share what tells whether it is poor."""

_GLANCE = 16  # views that a move is judged on first; then on four times as many, and so on
_POOR = 0.1  # of the mean score a triangle: one that adds less may be put elsewhere
_ELSEWHERE = 0.5  # how often it is
_PLACES = 16  # of which the one with most gaps is tried
_LOOKS = 16  # views in which gaps are looked for
_DRAWS = 8  # of a corner at most, until it is in the room
_REACH = 0.3  # how far the corners of a new triangle reach, as a share of the grid


@inner_kernel
def _random(state):
    """The next number in [0, 1) of a 64-bit xorshift generator, ``state`` (1,) uint64."""
    x = state[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    state[0] = x
    return float(x >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@inner_kernel
def _is_poor(index, views, images, layers, scores, union, part):
    """Whether a triangle adds little to what all others score, judged on every sixth view."""
    _, _, originals, price, fines = views
    value, total = np.int64(0), np.int64(0)
    for view in range(0, len(scores), 6):
        now, own = layers[view], images[index, view]
        adds, fronts = np.uint64(0), np.int64(0)
        for row in range(64):
            left = all_but_one(now, own, row)
            union[row] = left
            adds |= left ^ now[0, row]
        for row in range(64, len(own)):
            left = all_but_one(now, own, row)
            adds |= left ^ now[0, row]
            fronts += np.int64(popcount(left))
        if adds != 0:  # mostly others hide it
            without = score_view(union, originals[view], price, fines[view, 0], part)
            value += scores[view] - without + fines[view, 1] * fronts
        total += scores[view]
    return value * len(images) < _POOR * total


@inner_kernel
def _find_cell(room, before, number):
    """Corner of the cell of that number among those with any room, in the order of the array.

    ``before`` (nx ny + 1,) int64: such cells in the columns before each one, and in all.
    """
    low, high = 0, len(before) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if before[middle] <= number:
            low = middle
        else:
            high = middle
    _, least, _, limit = room
    x, y = low // least.shape[1], low % least.shape[1]
    left = number - before[low]
    z = 0
    while left > 0 or least[x, y, z] > limit:
        if least[x, y, z] <= limit:
            left -= 1
        z += 1
    return x, y, z


@inner_kernel
def _place_anywhere(triangles, room, before, reach, state, trial):
    """A triangle by lot: beside an edge of another, or about one of the cells with room.

    A corner that would lie outside the room is drawn again, which costs a few nanoseconds.
    """
    reach *= 2.0 * _random(state)
    if _random(state) < 0.5:
        other = np.int64(_random(state) * len(triangles))
        begin = np.int64(_random(state) * 3)
        end = begin + 1
        for k in range(3):
            for axis in range(3):
                trial[k, axis] = triangles[other, k, axis]
        one, two = (begin + 1) % 3, (begin + 2) % 3
        x, y, z = (
            0.5 * (trial[one, 0] + trial[two, 0]),
            0.5 * (trial[one, 1] + trial[two, 1]),
            0.5 * (trial[one, 2] + trial[two, 2]),
        )
    else:
        begin, end = 0, 3
        cell = _find_cell(room, before, np.int64(_random(state) * before[-1]))
        x, y, z = cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5
    for k in range(begin, end):
        for _ in range(_DRAWS):
            trial[k, 0] = x + (_random(state) - 0.5) * reach
            trial[k, 1] = y + (_random(state) - 0.5) * reach
            trial[k, 2] = z + (_random(state) - 0.5) * reach
            point = corner(trial, k)
            if is_contained(point, point, point, room):
                break


@inner_kernel
def _count_gaps(triangle, projections, originals, layers, state):
    """In how many of :data:`_LOOKS` views by lot the middle of a triangle lies in a gap.

    A gap is a pixel of the original that nothing covers, with eight neighbours of the same kind: no
    triangle could fill a line of such pixels along an outline.
    """
    x = (triangle[0, 0] + triangle[1, 0] + triangle[2, 0]) / 3.0
    y = (triangle[0, 1] + triangle[1, 1] + triangle[2, 1]) / 3.0
    z = (triangle[0, 2] + triangle[1, 2] + triangle[2, 2]) / 3.0
    found = 0
    for _ in range(_LOOKS):
        view = np.int64(_random(state) * len(projections))
        m, there, union = projections[view], originals[view], layers[view, 0]
        column = np.int64(m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3])
        row = np.int64(m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3])
        if 0 <= column < 64 and 0 < row < 63:
            bare = there[row - 1] & there[row] & there[row + 1]
            bare &= ~(union[row - 1] | union[row] | union[row + 1])
            bare &= (bare << np.uint64(1)) & (bare >> np.uint64(1))
            found += np.int64(bare >> np.uint64(column) & np.uint64(1))
    return found


@inner_kernel
def _place_elsewhere(triangles, views, layers, room, before, reach, state, trial, best):
    """Write into ``trial`` (3, 3) that of several triangles by lot which lies in most gaps.

    ``best`` (3, 3) is used up.  To count gaps takes less than to draw a triangle in one view.
    """
    projections, _, originals, _, _ = views
    most = -1
    for _ in range(_PLACES):
        _place_anywhere(triangles, room, before, reach, state, trial)
        found = _count_gaps(trial, projections, originals, layers, state)
        if found > most:
            most = found
            best[:] = trial
    trial[:] = best


@inner_kernel
def _order_views(projections, order, ends, strides, blocks):
    """The views in the order of the looks at a move: those of the first, the second's others, …

    Writes ``order`` (V,) int64, where each look ends in it into ``ends``, and the projections in
    that order into ``blocks``.  ``strides`` are powers of two: after a look, one view of so many
    has been seen.  Returns the number of looks.
    """
    stride, seen, count, looks = 1, 0, 0, 0
    while stride * 2 * _GLANCE <= len(projections):
        stride *= 2
    while True:
        for view in range(0, len(projections), stride):
            if seen == 0 or view % seen != 0:
                order[count] = view
                put_projection(projections[view], count, blocks)
                count += 1
        ends[looks], strides[looks] = count, stride
        looks += 1
        if stride == 1:
            return looks
        stride, seen = max(stride // 4, 1), stride


@inner_kernel
def _try_views(
    p, q, r, index, looked_at, views, images, layers, scores, drawn, trial, union, part, edges,
    work,
):  # fmt: skip
    """Score the views of one look with the triangle p, q, r at ``index``; return the change.

    ``looked_at`` are the views in the order of looks, their projections in blocks, and where this
    look begins and ends.  Writes ``drawn`` (V, 64) and ``trial`` (V,) in those views.  Most moves
    leave most unions as they are, behind other triangles: those views keep their score.
    """
    projections, (away, limits, highest), originals, price, fines = views
    order, blocks, begin, end = looked_at
    priced = images.shape[2] > 64
    change = np.int64(0)
    found = begin  # the place of the first view whose edges are known
    for place in range(begin, end):
        if place == begin or place % BLOCK == 0:
            found = place
            find_edges(p, q, r, blocks, place, min(end, (place // BLOCK + 1) * BLOCK), edges)
        view = order[place]
        now, own, new = layers[view], images[index, view], drawn[view]
        draw_found(edges, place - found, new)
        work[0] += 1
        differs = np.uint64(0)
        for row in range(64):
            union[row] = all_but_one(now, own, row) | new[row]
            differs |= union[row] ^ now[0, row]
        trial[view] = scores[view]
        before = np.int64(0)  # pixels in front of which all stand
        if priced:
            shows = draw_front(
                p, q, r, projections[view], away[view], limits[view], highest[view], new,
                new[64:],
            )  # fmt: skip
            if not shows:
                for row in range(64, images.shape[2]):
                    shows |= own[row] != 0
            if shows or differs != 0:
                was = np.int64(0)
                for row in range(64, images.shape[2]):
                    before += np.int64(popcount(all_but_one(now, own, row) | new[row]))
                    was += np.int64(popcount(now[0, row]))
                trial[view] -= fines[view, 1] * (before - was)
        if differs != 0:
            work[1] += 1
            trial[view] = score_view(union, originals[view], price, fines[view, 0], part)
            if priced:
                trial[view] -= fines[view, 1] * before
        change += trial[view] - scores[view]
    return change


@kernel(
    "float64[:, :, :], float64[:, :, :], (float64[:, :], float32[:, :, :], float32[:, :]), "
    "uint64[:, :], int64, int64[:, :], (uint8[:, :, :], uint8[:, :, :], uint8[:, :, :], int64), "
    "int64[:], uint64[:, :, :], uint64[:, :, :], int64[:], float64[:, :, :], int64[:], "
    "uint64[:], int64, (float64, float64), (float64, float64), (float64, float64), int64[:]"
)
def anneal(
    triangles, projections, depths, originals, price, fines, room, before, images, layers, scores,
    best, best_score, state, moves, shares, steps, heats, work,
):  # fmt: skip
    """Try ``moves`` moves, a multiple of :data:`TRIES`; ``shares`` of the search begin and end.

    A corner moves by up to a step a coordinate; a move that gains is tried again in the same
    direction.  A triangle that adds little is put elsewhere at times, mostly where a gap is.  A
    move is taken when the triangle keeps to the ``room`` and the score rises, or falls by no more
    than chance allows (simulated annealing).  ``steps`` (voxels) and ``heats`` (score) are first
    and last values of the whole search, geometric in between.

    ``triangles``, ``images``, ``layers`` and ``scores`` are the current state, ``best`` the best
    triangles yet, ``best_score`` (1,) int64 their score.  ``work`` (2,) int64 counts the views that
    are drawn and those that are scored.
    """
    count = len(triangles)
    views = (projections, depths, originals, price, fines)
    union, part = np.zeros(64, np.uint64), np.zeros(64, np.uint64)
    drawn = np.zeros(images.shape[1:], np.uint64)
    carries = np.zeros((2, images.shape[2]), np.uint64)
    trial_scores = np.zeros(len(scores), np.int64)
    trial, spare = np.zeros((3, 3)), np.zeros((3, 3))
    delta = np.zeros(3)
    cells = room[1].shape
    reach = _REACH * max(cells[0], cells[1], cells[2])
    order = np.zeros(len(scores), np.int64)
    ends, strides = np.zeros(64, np.int64), np.zeros(64, np.int64)
    blocks = np.zeros((len(scores) + BLOCK - 1) // BLOCK * (8 * BLOCK))
    edges = np.zeros(15 * BLOCK)
    looks = _order_views(projections, order, ends, strides, blocks)
    total = np.sum(scores)
    index, moved = 0, 0
    again, poor = False, False
    for move in range(moves):
        share = shares[0] + (shares[1] - shares[0]) * move / moves
        if move % TRIES == 0:
            index = np.int64(_random(state) * count)
            poor = _is_poor(index, views, images, layers, scores, union, part)
            again = False
        for k in range(3):
            for axis in range(3):
                trial[k, axis] = triangles[index, k, axis]
        anew = poor and not again and _random(state) < _ELSEWHERE
        if anew:
            _place_elsewhere(triangles, views, layers, room, before, reach, state, trial, spare)
        else:
            if not again:
                moved = np.int64(_random(state) * 3)
                step = 2.0 * steps[0] * (steps[1] / steps[0]) ** share
                for axis in range(3):
                    delta[axis] = (_random(state) - 0.5) * step
            for axis in range(3):
                trial[moved, axis] += delta[axis]
        again = False
        # The other corners of a triangle that is there are in the room.
        begin, end = (0, 3) if anew else (moved, moved + 1)
        inside = True
        for k in range(begin, end):
            point = corner(trial, k)
            inside = inside and is_contained(point, point, point, room)
        if not inside:
            continue
        p, q, r = corner(trial, 0), corner(trial, 1), corner(trial, 2)
        least = heats[0] * (heats[1] / heats[0]) ** share * np.log(_random(state) + 1e-300)
        change = np.int64(0)
        taken = True
        for look in range(looks):
            # As dear as some fifty views, so it comes after a few and before most of them.
            if look == looks - 1 and not is_contained(p, q, r, room):
                taken = False
                break
            begin = ends[look - 1] if look > 0 else 0
            change += _try_views(
                p, q, r, index, (order, blocks, begin, ends[look]), views, images, layers, scores,
                drawn, trial_scores, union, part, edges, work,
            )  # fmt: skip
            # A few views that lose this much are hardly made good by the others.
            taken = change * strides[look] >= (2 * least if look < looks - 1 else least)
            if not taken:
                break
        if not taken:
            continue
        for view in range(len(scores)):
            scores[view] = trial_scores[view]
            exchange_picture(layers[view], images[index, view], drawn[view], carries)
        for k in range(3):
            for axis in range(3):
                triangles[index, k, axis] = trial[k, axis]
        total += change
        again = change > 0 and not anew
        poor = poor and not anew
        if total > best_score[0]:
            best_score[0] = total
            for other in range(count):
                for k in range(3):
                    for axis in range(3):
                        best[other, k, axis] = triangles[other, k, axis]
