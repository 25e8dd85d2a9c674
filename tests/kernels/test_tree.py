"""Splits and shared parents against the plain way, on boxes whose costs are exact numbers."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.tree import BINS, bound_nodes, split_boxes, widen


def whole_boxes(seed, count, span=200, largest=40):
    """(n, 2, 3) with corners at even whole numbers: areas, costs and centres are exact."""
    generator = np.random.default_rng(seed)
    low = 2 * generator.integers(-span, span, (count, 3))
    size = 2 * generator.integers(0, largest, (count, 3))
    return np.stack([low, low + size], axis=1).astype(np.float64)


def binary_tree(boxes):
    """(order, lefts, spans, bounds) of the kernels."""
    lows, highs = (np.array(boxes[:, side], order="C") for side in (0, 1))
    nodes = 2 * len(boxes) - 1
    order, lefts = np.arange(len(boxes)), np.empty(nodes, dtype=np.int64)
    spans, bounds = np.empty((nodes, 2), dtype=np.int64), np.empty((nodes, 2, 3))
    assert split_boxes(lows, highs, order, lefts, spans) == nodes
    bound_nodes(lows, highs, order, lefts, spans, bounds)
    return order, lefts, spans, bounds


def half_area(boxes):
    x, y, z = boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)
    return x * y + y * z + z * x


def plain_split(boxes):
    """(n,) which go left by the cheapest plane of all axes; None where all have one place."""
    centres = boxes.mean(axis=1)
    best, left = np.inf, None
    for axis in range(3):
        place = centres[:, axis]
        if np.ptp(place) == 0.0:
            continue
        cells = np.floor(place / 2.0 ** np.floor(np.log2(np.ptp(place) / BINS)))
        for plane in range(int(cells.min()), int(cells.max())):
            side = cells <= plane
            cost = half_area(boxes[side]) * side.sum() + half_area(boxes[~side]) * (~side).sum()
            if cost < best:
                best, left = cost, side
    return left


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([3, 200]))
def test_every_split_is_the_cheapest(seed, count, span):
    """Boxes crowd where the span is small: several have one centre."""
    boxes = whole_boxes(seed, count, span, largest=4 if span == 3 else 40)
    order, lefts, spans, bounds = binary_tree(boxes)
    for node, left in enumerate(lefts):
        below = order[slice(*spans[node])]
        np.testing.assert_array_equal(
            bounds[node], [boxes[below, 0].min(axis=0), boxes[below, 1].max(axis=0)]
        )
        if left < 0:
            assert len(below) == 1
            continue
        assert spans[left, 0] == spans[node, 0]
        assert spans[left, 1] == spans[left + 1, 0]
        assert spans[left + 1, 1] == spans[node, 1]
        side = plain_split(boxes[below])
        if side is None:
            assert spans[left, 1] - spans[left, 0] == len(below) // 2
        else:
            assert set(order[slice(*spans[left])]) == set(below[side])


def plain_frontier(lefts, node, most):
    """The children that a binary node would have, and its parent may take over."""
    if lefts[node] < 0:
        return [node]
    left, right = lefts[node], lefts[node] + 1
    ours, theirs = (plain_frontier(lefts, child, most) for child in (left, right))
    if len(ours) + len(theirs) > most:
        if len(ours) >= len(theirs):
            ours = [left]
        else:
            theirs = [right]
    if len(ours) + len(theirs) > most:
        ours, theirs = [left], [right]
    return ours + theirs


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(2, 80), st.integers(2, 9))
def test_neighbours_share_a_parent(seed, count, most):
    _, lefts, _, _ = binary_tree(whole_boxes(seed, count))
    first, counts, sources = (np.empty(len(lefts), dtype=np.int64) for _ in range(3))
    nodes = widen(lefts, most, first, counts, sources)
    seen = 1
    for node in range(nodes):
        children = sources[first[node] : first[node] + counts[node]].tolist()
        if lefts[sources[node]] < 0:
            assert not children
            continue
        assert first[node] == seen  # breadth first
        seen += len(children)
        assert children == plain_frontier(lefts, sources[node], most)
    assert seen == nodes
