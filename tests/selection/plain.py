"""Selection without laziness, coarse scores or queues: slow forms to compare with."""

from __future__ import annotations

import numpy as np

from simplifier.selection.candidates import score


def union(candidates, cut):
    """(views, 64) images of a cut."""
    images = candidates.nothing()
    for polygon in np.nonzero(cut)[0]:
        images |= candidates.draw(int(polygon), int(cut[polygon]))
    return images


def value(candidates, cut):
    """Score of a cut."""
    return score(union(candidates, cut))


def is_complete(candidates, cut, alpha):
    """True when no polygon that is left would raise the score by ``alpha`` of it, or at all."""
    images = union(candidates, cut)
    total = score(images)
    left = np.nonzero(np.asarray(cut) == 0)[0]
    gains = [
        score(images | candidates.draw(int(p), int(candidates.triangles[p]))) - total for p in left
    ]
    return all(gain <= 0 or gain < alpha * total for gain in gains)


def fill(candidates, polygons, levels, budget, alpha, weights):
    """Add the (polygon, level) pair with the best weighted gain, the first of equals, each time."""
    cut = np.zeros(len(candidates), dtype=np.int32)
    images = [candidates.draw(int(p), int(k)) for p, k in zip(polygons, levels, strict=True)]
    shut = np.zeros(len(polygons), dtype=np.bool_)
    while True:
        base = union(candidates, cut)
        total = score(base)
        costs = levels - cut[polygons]
        can = np.nonzero((costs > 0) & (costs <= budget - cut.sum()) & ~shut)[0]
        gains = np.zeros(len(polygons), dtype=np.int64)
        gains[can] = [score(base | images[pair]) - total for pair in can]
        worth = gains * weights[np.maximum(costs, 0).clip(max=budget)]
        best = int(np.argmax(worth))
        if worth[best] <= 0.0 or gains[best] < alpha * total:
            return cut
        before = cut[polygons[best]]
        cut[polygons[best]] = levels[best]
        if value(candidates, cut) <= total:
            cut[polygons[best]] = before
            shut[best] = True


def best_value(candidates, budget):
    """The highest score that any cut within the budget has, by trying all of them."""
    images = [
        [candidates.draw(p, k) for k in range(1, min(int(most), budget) + 1)]
        for p, most in enumerate(candidates.triangles)
    ]

    def best(polygon, base, left):
        if polygon == len(images):
            return score(base)
        taken = [
            best(polygon + 1, base | image, left - level)
            for level, image in enumerate(images[polygon][:left], start=1)
        ]
        return max([best(polygon + 1, base, left), *taken])

    return best(0, candidates.nothing(), budget)


def trimmed(candidates, cut, budget):
    """Of all cuts with one triangle less, the one with most surface area, until it fits."""
    areas = [_areas(candidates, polygon) for polygon in range(len(candidates))]
    cut = np.array(cut)
    while cut.sum() > budget:
        members = np.nonzero(cut)[0]
        losses = [areas[p][cut[p]] - areas[p][cut[p] - 1] for p in members]
        cut[members[int(np.argmin(losses))]] -= 1
    return cut


def _areas(candidates, polygon):
    """Area by level, by triangles from the first corner."""
    begin, end = candidates.offsets[polygon : polygon + 2]
    areas = [0.0]
    for level in range(1, int(candidates.triangles[polygon]) + 1):
        ring = candidates.points[begin:end][candidates.lowest[begin:end] <= level]
        first, second = ring[1:-1] - ring[0], ring[2:] - ring[0]
        areas.append(float(0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()))
    return areas
