"""Inner boxes: the largest is found, none leaves what is inside, and later ones add to it."""

from __future__ import annotations

from itertools import product

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from simplifier.visibility.strong.inner_boxes import largest_box, placed_boxes

GRIDS = arrays(np.bool_, array_shapes(min_dims=3, max_dims=3, max_side=5))


def cells(box):
    return tuple(slice(*ends) for ends in box.T)


def plain_largest(inside):
    """Voxels of the largest box that is all inside, by trying all of them."""
    ranges = [[(a, b) for a in range(n) for b in range(a + 1, n + 1)] for n in inside.shape]
    blocks = (inside[tuple(slice(*ends) for ends in three)] for three in product(*ranges))
    return max((block.size for block in blocks if block.all()), default=0)


@given(GRIDS)
def test_the_largest_box_is_as_large_as_any(inside):
    box = largest_box(inside)
    assert inside[cells(box)].all()
    assert np.prod(box[1] - box[0]) == plain_largest(inside)


@given(GRIDS, st.integers(0, 4))
def test_boxes_stay_inside_and_each_adds_something(inside, count):
    boxes = placed_boxes(inside, count)
    assert len(boxes) <= count
    covered = np.zeros_like(inside)
    for box in boxes:
        before = covered.sum()
        covered[cells(box)] = True
        assert covered.sum() > before
    assert not (covered & ~inside).any()
    assert len(boxes) == count or np.array_equal(covered, inside)
