"""Trees over boxes: every box once, boxes within boxes, and little change for little change."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.hierarchy.tree import build_tree
from tests.kernels.test_tree import whole_boxes


def check(tree, boxes, width):
    """What every tree over boxes has to be."""
    assert sorted(tree.order) == list(range(len(boxes)))
    assert tree.spans[0].tolist() == [0, len(boxes)]
    parents = np.full(len(tree), -1)
    for node in range(len(tree)):
        below = tree.below(node)
        expected = [boxes[below, 0].min(axis=0), boxes[below, 1].max(axis=0)]
        np.testing.assert_array_equal(tree.bounds[node], expected)
        children = tree.children_of(node)
        assert tree.is_leaf[node] == (len(children) == 0)
        if len(children) == 0:
            assert len(below) == 1
            continue
        assert 2 <= len(children) <= width
        assert min(children) > node
        assert (parents[children] == -1).all()
        parents[children] = node
        ends = tree.spans[children]
        assert ends[0, 0] == tree.spans[node, 0]
        assert ends[-1, 1] == tree.spans[node, 1]
        assert (ends[1:, 0] == ends[:-1, 1]).all()
    assert (parents[1:] >= 0).all()


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 120),
    st.integers(2, 64),
    st.sampled_from([0.0, 1e7, -3e9]),
    st.sampled_from([1e-3, 1.0, 1e5]),
)
def test_holds_every_box_once(seed, count, width, offset, scale):
    generator = np.random.default_rng(seed)
    corners = (
        generator.normal(size=(count, 3)) * scale * generator.choice([1.0, 0.0], 3, p=[0.8, 0.2])
    )
    sizes = generator.exponential(0.1 * scale, (count, 3)) * generator.choice(
        [1.0, 0.0], (count, 1)
    )
    boxes = np.stack([corners, corners + sizes], axis=1) + offset
    check(build_tree(boxes, width), boxes, width)


@pytest.mark.parametrize("count", [1, 2, 9, 100])
@pytest.mark.parametrize("width", [2, 8])
def test_identical_boxes(count, width):
    boxes = np.tile([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]], (count, 1, 1))
    check(build_tree(boxes, width), boxes, width)


@pytest.mark.parametrize("scale", [1e-323, 1e-310, 1e-200, 1e150, 1e300])
def test_tiny_and_huge_places(scale):
    boxes = whole_boxes(1, 40) * scale
    check(build_tree(boxes, 4), boxes, 4)


def test_one_box_is_a_leaf_and_two_have_a_root():
    assert len(build_tree(whole_boxes(0, 1), 8)) == 1
    assert build_tree(whole_boxes(0, 2), 8).children.tolist() == [[1, 2], [0, 0], [0, 0]]


def test_does_not_write_to_its_input():
    boxes = whole_boxes(3, 20)
    boxes.setflags(write=False)
    check(build_tree(boxes, 8), boxes, 8)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 80), st.integers(-3, 3))
def test_translation_by_powers_of_two_changes_no_node(seed, count, steps):
    """Planes stand at multiples of powers of two, so they move along."""
    boxes = whole_boxes(seed, count)
    here, there = build_tree(boxes, 8), build_tree(boxes + steps * 2.0**20, 8)
    np.testing.assert_array_equal(here.order, there.order)
    np.testing.assert_array_equal(here.children, there.children)
    np.testing.assert_array_equal(here.spans, there.spans)


def test_the_order_of_the_boxes_changes_no_node():
    boxes = whole_boxes(5, 200)
    shuffled = np.random.default_rng(5).permutation(len(boxes))
    assert {frozenset(shuffled[s].tolist()) for s in sets(build_tree(boxes[shuffled], 8))} == {
        frozenset(s.tolist()) for s in sets(build_tree(boxes, 8))
    }


def sets(tree):
    """What lies below each node."""
    return [tree.below(node) for node in range(len(tree))]


def city_boxes(seed, count=1000):
    """Buildings on a plain."""
    generator = np.random.default_rng(seed)
    x, z, wide, deep = generator.uniform(
        [[0], [0], [8], [8]], [[1000], [1000], [30], [30]], (4, count)
    )
    low = np.column_stack([x, np.zeros(count), z])
    size = np.column_stack([wide, generator.uniform(5.0, 60.0, count), deep])
    return np.stack([low, low + size], axis=1)


def test_a_grown_box_changes_few_nodes():
    """A node is the same when the same boxes lie below it: then its occluder is not made again.

    Only the boxes of the path to the root change then.  Most changes of one building leave all
    nodes the same but a handful; now and then a plane near the root becomes dearer than another.
    """
    boxes = city_boxes(0)
    before = {frozenset(some.tolist()) for some in sets(build_tree(boxes, 8))}
    fresh = []
    for grown in range(0, 1000, 25):
        changed = boxes.copy()
        changed[grown, 1] += [5.0, 10.0, 5.0]
        after = {frozenset(some.tolist()) for some in sets(build_tree(changed, 8))}
        fresh.append(len(after - before) / len(after))
    assert np.mean(fresh) < 0.02
    assert np.quantile(fresh, 0.9) < 0.04
