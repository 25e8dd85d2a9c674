"""What a horizon hides: no line from the cell passes above it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.visibility.cull_maps.horizon import Horizon, range_minimum

SIZE = 16


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=20), st.data())
def test_range_minimum(values, data):
    first = data.draw(st.integers(0, len(values) - 1))
    last = data.draw(st.integers(first, len(values) - 1))
    found = range_minimum(np.array(values), np.array([first]), np.array([last]))
    assert found[0] == min(values[first : last + 1])


def passes(horizon, viewer, target):
    """Whether a line from a point of the cell to a target leaves the window above its umbra."""
    share = 1.0
    for axis in (0, 1):
        for border in (0.5, SIZE - 0.5):
            way = target[axis] - viewer[axis]
            if way and 0.0 < (border - viewer[axis]) / way < share:
                share = (border - viewer[axis]) / way
    at = np.array(viewer) + share * (np.array(target) - np.array(viewer))
    x, y = np.clip(np.floor(at[:2]), 0, SIZE - 1).astype(int)
    return at[2] > horizon.umbra[x, y]


@pytest.mark.parametrize("seed", range(12))
def test_no_line_to_what_is_hidden_passes_above_it(seed):
    random = np.random.default_rng(seed)
    umbra = random.uniform(2.0, 9.0, (SIZE, SIZE))
    cell = np.array([[6.2, 7.1], [8.9, 9.4]])
    horizon = Horizon(umbra, cell, 3.0)
    low = random.uniform(-40.0, 50.0, (40, 2))
    boxes = np.stack([low, low + random.uniform(0.5, 12.0, (40, 2))], axis=1)
    tops = random.uniform(0.0, 12.0, 40)
    hidden = horizon.hides(boxes, tops)
    for box, top in zip(boxes[hidden], tops[hidden], strict=True):
        for _ in range(60):
            viewer = [*random.uniform(cell[0], cell[1]), 3.0]
            target = [*random.uniform(box[0], box[1]), top]
            beyond = max(abs(target[0] - SIZE / 2), abs(target[1] - SIZE / 2)) > SIZE / 2 - 0.5
            assert not (beyond and passes(horizon, viewer, target))
    far = (np.abs(boxes - SIZE / 2).max(axis=2) > SIZE / 2).all(axis=1)
    assert (hidden & far).any()
    assert not hidden[tops > 11.0].all() or not (tops > 11.0).any()


def test_what_lies_within_is_not_its_business_and_nothing_hides_nothing():
    cell = np.array([[7.0, 7.0], [9.0, 9.0]])
    boxes = np.array([[[2.0, 2.0], [4.0, 4.0]], [[30.0, 6.0], [34.0, 8.0]]])
    none = Horizon(np.full((SIZE, SIZE), -np.inf), cell, 2.0)
    assert none.hides(boxes, np.array([90.0, 1.0])).tolist() == [True, False]
    wall = Horizon(np.full((SIZE, SIZE), 5.0), cell, 2.0)
    assert wall.hides(boxes, np.array([90.0, 9.0])).tolist() == [True, True]
    assert wall.hides(boxes, np.array([90.0, 12.1])).tolist() == [True, False]
