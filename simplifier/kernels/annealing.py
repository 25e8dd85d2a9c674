"""Anneal the triangles of an occluder: random moves that raise its score inside a room.

Arrays as in :mod:`simplifier.kernels.soup_views`; ``scores`` (V,) int64 is what each view scores.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.bit_image import popcount
from simplifier.kernels.compiled.kernel import inner_kernel, kernel
from simplifier.kernels.slab import keep_between
from simplifier.kernels.soup_views import (
    BLOCK,
    OUTLINE_NUMBERS,
    all_but_one,
    all_eights,
    block_size,
    corner,
    draw_found,
    draw_front,
    exchange_picture,
    find_outlines,
    put_projection,
    score_exchange,
)
from simplifier.kernels.voxelize import ROOM, is_contained

TRIES = 6
"""Moves tried at a triangle before another is drawn; they share what tells whether it is poor."""

_SAMPLE = 6  # views for each one in which it is judged what a triangle adds
_POOR = 0.1  # of the mean score a triangle: one that adds less may be put elsewhere
_ELSEWHERE = 0.5  # how often it is
_PLACES = 16  # of which the one is tried that gains most
_GUIDED = 0.5  # how often a corner's step is one of so many, too
_LOOKS = 16  # views in which places are looked at: all of it takes less than a look at a move
_LOSS = 2  # of a pixel that sticks out, beside one that is covered
_LEAST = -1_000_000  # less than anything loses
_REFUSED = -(1 << 62)  # in place of what a move changes
_MOST = 1 << 62  # more than any triangle adds
_ASIDE = 0.7  # of the way from a triangle's middle to a corner
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
def _worth_of(index, views, images, layers, scores, nothing):
    """What a triangle adds to what all others score, in every sixth view."""
    _, _, originals, price, fines = views
    value = np.int64(0)
    for view in range(0, len(scores), _SAMPLE):
        now, own = layers[view], images[index, view]
        adds, fronts = np.uint64(0), np.int64(0)
        for row in range(64):
            adds |= all_but_one(now, own, row) ^ now[0, row]
        for row in range(64, len(own)):
            left = all_but_one(now, own, row)
            adds |= left ^ now[0, row]
            fronts += np.int64(popcount(left))
        if adds != 0:  # mostly others hide it
            without = score_exchange(now, own, nothing, originals[view], price, fines[view, 0])
            value += scores[view] - without + fines[view, 1] * fronts
    return value


@inner_kernel
def _is_poor(index, views, images, layers, scores, nothing):
    """Whether a triangle adds little to what all others score."""
    total = np.int64(0)
    for view in range(0, len(scores), _SAMPLE):
        total += scores[view]
    value = _worth_of(index, views, images, layers, scores, nothing)
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
    _, least, _, limit, _, _ = room
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
def _transpose(projections, transposed, order):
    """Fill ``transposed`` (8, V + 16) with each of the eight numbers of all projections, the first
    ones once more at the end; ``order`` (V + 16,) int64 says of which view."""
    for place in range(len(order)):
        order[place] = place % len(projections)
        for number in range(8):
            transposed[number, place] = projections[order[place], number // 4, number % 4]


@inner_kernel
def _gain_at(x, y, z, first, lookup, layers):
    """What it would gain to cover a point, in :data:`_LOOKS` views from ``first`` on: one in each
    where it lies in the original and nothing covers it yet, less :data:`_LOSS` in each where it
    lies outside and nothing does.

    ``lookup`` holds what :func:`_transpose` fills, and the originals.  Without a branch, so that
    the loop works on several views at once.
    """
    m, order, originals = lookup
    gain = np.int64(0)
    for view in range(first, first + _LOOKS):
        at = np.uint64(view)
        column = m[0, at] * x + m[1, at] * y + m[2, at] * z + m[3, at]
        row = m[4, at] * x + m[5, at] * y + m[6, at] * z + m[7, at]
        shows = (column >= 0.0) & (column < 64.0) & (row >= 0.0) & (row < 64.0)
        line, bit = np.uint64(row if shows else 0.0), np.uint64(column if shows else 0.0)
        picture = np.uint64(order[at])
        inside = np.int64(originals[picture, line] >> bit & np.uint64(1))
        bare = np.int64(~layers[picture, np.uint64(0), line] >> bit & np.uint64(1))
        gain += bare * (inside * (1 + _LOSS) - _LOSS) if shows else -_LOSS
    return gain


@inner_kernel
def _draw_step(point, step, lookup, layers, state, delta):
    """Fill ``delta`` (3,) with a step by lot from ``point`` (3,), up to half of ``step`` a
    coordinate; half of the time with the one of several that leads to where most is gained."""
    first = np.int64(_random(state) * len(layers))
    draws = _PLACES if _random(state) < _GUIDED else 1
    most = _LEAST
    for _ in range(draws):
        x = (_random(state) - 0.5) * step
        y = (_random(state) - 0.5) * step
        z = (_random(state) - 0.5) * step
        gain = most + 1
        if draws > 1:
            gain = _gain_at(point[0] + x, point[1] + y, point[2] + z, first, lookup, layers)
        if gain > most:
            most = gain
            delta[0], delta[1], delta[2] = x, y, z


@inner_kernel
def _gain_of(triangle, first, lookup, layers):
    """As :func:`_gain_at`, of the middle of a triangle and of three points towards its corners."""
    x = (triangle[0, 0] + triangle[1, 0] + triangle[2, 0]) / 3.0
    y = (triangle[0, 1] + triangle[1, 1] + triangle[2, 1]) / 3.0
    z = (triangle[0, 2] + triangle[1, 2] + triangle[2, 2]) / 3.0
    gain = _gain_at(x, y, z, first, lookup, layers)
    for k in range(3):
        gain += _gain_at(
            x + _ASIDE * (triangle[k, 0] - x), y + _ASIDE * (triangle[k, 1] - y),
            z + _ASIDE * (triangle[k, 2] - z), first, lookup, layers,
        )  # fmt: skip
    return gain


@inner_kernel
def _place_elsewhere(triangles, lookup, layers, room, before, reach, state, trial, best):
    """Write into ``trial`` (3, 3) the one of several triangles by lot that gains most.

    ``best`` (3, 3) is used up.
    """
    most = _LEAST
    for _ in range(_PLACES):
        _place_anywhere(triangles, room, before, reach, state, trial)
        gain = _gain_of(trial, np.int64(_random(state) * len(layers)), lookup, layers)
        if gain > most:
            most = gain
            best[:] = trial
    trial[:] = best


@inner_kernel
def _try_views(
    p, q, r, index, begin, end, triangles, blocks, views, images, layers, scores, drawn, eights,
    trial, outlines, work,
):  # fmt: skip
    """Score the views ``begin`` to ``end`` with the triangle p, q, r at ``index``; return the
    change.

    Writes ``drawn`` (V, 64), ``eights`` (V,) and ``trial`` (V,) in those views.  Most moves leave
    most unions as they are, behind other triangles: those views keep their score.
    """
    projections, (away, limits, highest), originals, price, fines = views
    priced = images.shape[2] > 64
    change = np.int64(0)
    found = begin  # the first view whose outlines are known
    for view in range(begin, end):
        if view == begin or view % BLOCK == 0:
            found = view
            last = min(end, (view // BLOCK + 1) * BLOCK)
            find_outlines(p, q, r, triangles[index], blocks, view, last, outlines)
        now, own, new = layers[view], images[index, view], drawn[view]
        differs = draw_found(outlines, view - found, now, own, new, eights[view:])
        work[0] += 1
        trial[view] = scores[view]
        before = np.int64(0)  # pixels in front of which all stand
        if priced:
            eights[view] |= all_eights(own)
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
            trial[view] = score_exchange(now, own, new, originals[view], price, fines[view, 0])
            if priced:
                trial[view] -= fines[view, 1] * before
        change += trial[view] - scores[view]
    return change


@inner_kernel
def _scratch(projections, images):
    """What :func:`_change_by` writes: pictures and eights of a triangle, and scores, in each view;
    and the projections and the outlines as :func:`find_outlines` takes them."""
    count = len(projections)
    blocks = np.zeros(block_size(count))
    for view in range(count):
        put_projection(projections[view], view, blocks)
    return (
        np.zeros(images.shape[1:], np.uint64), np.zeros(count, np.uint64),
        np.zeros(count, np.int64), blocks, np.zeros(OUTLINE_NUMBERS * BLOCK),
    )  # fmt: skip


@inner_kernel
def _change_by(
    trial, index, least, triangles, room, views, looks, images, layers, scores, scratch, work
):  # fmt: skip
    """The change of the score with the triangle ``trial`` (3, 3) in place of the one at ``index``;
    :data:`_REFUSED` where that is less than ``least``, or it leaves the room."""
    drawn, eights, trial_scores, blocks, outlines = scratch
    p, q, r = corner(trial, 0), corner(trial, 1), corner(trial, 2)
    change = np.int64(0)
    seen = 0
    for look in range(len(looks)):
        end, times = looks[look]
        # As dear as some fifty views, so it comes after a few and before most of them.
        if times == 1 and not is_contained(p, q, r, room):
            return np.int64(_REFUSED)
        change += _try_views(
            p, q, r, index, seen, end, triangles, blocks, views, images, layers, scores, drawn,
            eights, trial_scores, outlines, work,
        )  # fmt: skip
        seen = end
        # A few views that lose this much are hardly made good by the others.
        if change * times < (2 * least if times > 1 else least):
            return np.int64(_REFUSED)
    return change


@inner_kernel
def _put(trial, index, total, triangles, images, layers, scores, scratch, best, best_score):
    """Put the triangle that :func:`_change_by` saw last in place, which makes the score ``total``;
    note the best yet."""
    drawn, eights, trial_scores, _, _ = scratch
    for view in range(len(scores)):
        scores[view] = trial_scores[view]
        exchange_picture(layers[view], images[index, view], drawn[view], eights[view])
    for k in range(3):
        for axis in range(3):
            triangles[index, k, axis] = trial[k, axis]
    if total > best_score[0]:
        best_score[0] = total
        for other in range(len(triangles)):
            for k in range(3):
                for axis in range(3):
                    best[other, k, axis] = triangles[other, k, axis]


@kernel(
    "float64[:, :, :], float64[:, :, :], (float64[:, :], float32[:, :, :], float32[:, :]), "
    f"uint64[:, :], int64, int64[:, :], {ROOM}, "
    "int64[:], uint64[:, :, :], uint64[:, :, :], int64[:], float64[:, :, :], int64[:], "
    "uint64[:], int64[:, :], int64, (float64, float64), (float64, float64), (float64, float64), "
    "int64[:]"
)
def anneal(
    triangles, projections, depths, originals, price, fines, room, before, images, layers, scores,
    best, best_score, state, looks, moves, shares, steps, heats, work,
):  # fmt: skip
    """Try ``moves`` moves, a multiple of :data:`TRIES`; ``shares`` of the search begin and end.

    A corner moves by up to a step a coordinate, half of the time to where most is to be gained; a
    move that gains is tried again in the same direction.  A triangle that adds little is put
    elsewhere at times, mostly where a gap is.  A move is taken when the triangle keeps to the
    ``room`` and the score rises, or falls by no more than chance allows (simulated annealing).
    ``steps`` (voxels) and ``heats`` (score) are first and last values of the whole search,
    geometric in between.

    A move is judged on some views first, then on more: each row of ``looks`` (n, 2) says at which
    view a look ends, and how many times as many views there are.  The last one ends with all.

    ``triangles``, ``images``, ``layers`` and ``scores`` are the current state, ``best`` the best
    triangles yet, ``best_score`` (1,) int64 their score.  ``work`` (2,) int64 counts the views that
    are drawn and those that are scored.
    """
    count = len(triangles)
    views = (projections, depths, originals, price, fines)
    nothing = np.zeros(images.shape[2], np.uint64)
    scratch = _scratch(projections, images)
    trial, spare = np.zeros((3, 3)), np.zeros((3, 3))
    delta = np.zeros(3)
    cells, slab = room[1].shape, room[5]
    reach = _REACH * max(cells[0], cells[1], cells[2])
    places = len(scores) + _LOOKS
    lookup = (np.empty((8, places)), np.empty(places, np.int64), originals)
    _transpose(projections, lookup[0], lookup[1])
    total = np.sum(scores)
    index, moved = 0, 0
    again, poor = False, False
    for move in range(moves):
        share = shares[0] + (shares[1] - shares[0]) * move / moves
        if move % TRIES == 0:
            index = np.int64(_random(state) * count)
            poor = _is_poor(index, views, images, layers, scores, nothing)
            again = False
        for k in range(3):
            for axis in range(3):
                trial[k, axis] = triangles[index, k, axis]
        anew = poor and not again and _random(state) < _ELSEWHERE
        if anew:
            _place_elsewhere(triangles, lookup, layers, room, before, reach, state, trial, spare)
        else:
            if not again:
                moved = np.int64(_random(state) * 3)
                step = 2.0 * steps[0] * (steps[1] / steps[0]) ** share
                _draw_step(trial[moved], step, lookup, layers, state, delta)
            for axis in range(3):
                trial[moved, axis] += delta[axis]
        again = False
        # The other corners of a triangle that is there are in the room.
        begin, end = (0, 3) if anew else (moved, moved + 1)
        inside = True
        for k in range(begin, end):
            keep_between(trial[k], slab)
            point = corner(trial, k)
            inside = inside and is_contained(point, point, point, room)
        if not inside:
            continue
        least = heats[0] * (heats[1] / heats[0]) ** share * np.log(_random(state) + 1e-300)
        change = _change_by(
            trial, index, least, triangles, room, views, looks, images, layers, scores, scratch,
            work,
        )  # fmt: skip
        if change == _REFUSED:
            continue
        total += change
        _put(trial, index, total, triangles, images, layers, scores, scratch, best, best_score)
        again = change > 0 and not anew
        poor = poor and not anew


@inner_kernel
def _nearest(triangle, triangles):
    """Index of the one of ``triangles`` whose corners are nearest to those of another, and the sum
    of their squared distances."""
    found, least = 0, np.inf
    for index in range(len(triangles)):
        distance = 0.0
        for k in range(3):
            for axis in range(3):
                distance += (triangles[index, k, axis] - triangle[k, axis]) ** 2
        if distance < least:
            found, least = index, distance
    return found, least


@inner_kernel
def _lowest(values):
    """Index of the first of the lowest."""
    found = 0
    for index in range(len(values)):
        if values[index] < values[found]:
            found = index
    return found


@kernel(
    "float64[:, :, :], float64[:, :, :], float64[:, :, :], "
    "(float64[:, :], float32[:, :, :], float32[:, :]), "
    f"uint64[:, :], int64, int64[:, :], {ROOM}, "
    "uint64[:, :, :], uint64[:, :, :], int64[:], float64[:, :, :], int64[:], int64[:, :], int64[:]"
)
def take_from(
    others, triangles, projections, depths, originals, price, fines, room, images, layers, scores,
    best, best_score, looks, work,
):  # fmt: skip
    """Put each of ``others`` (k, 3, 3) where that raises the score: in place of the triangle that
    is nearest to it, or else of the one that adds least.

    All else is as :func:`anneal` has it.
    """
    views = (projections, depths, originals, price, fines)
    scratch = _scratch(projections, images)
    nothing = np.zeros(images.shape[2], np.uint64)
    worths = np.zeros(len(triangles), np.int64)
    for index in range(len(triangles)):
        worths[index] = _worth_of(index, views, images, layers, scores, nothing)
    total = np.sum(scores)
    for other in range(len(others)):
        index, distance = _nearest(others[other], triangles)
        if distance == 0.0:  # both have it
            continue
        for _ in range(2):
            change = _change_by(
                others[other], index, 1.0, triangles, room, views, looks, images, layers, scores,
                scratch, work,
            )  # fmt: skip
            if change != _REFUSED:
                total += change
                _put(
                    others[other], index, total, triangles, images, layers, scores, scratch, best,
                    best_score,
                )  # fmt: skip
                worths[index] = _MOST  # it adds something, and stays until the next exchange
                break
            index = _lowest(worths)
