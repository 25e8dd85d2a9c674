"""Hollow voxels, against accumulation along the axes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.fill import count_hollow


def plain(touched, least):
    """Sides from which something lies before a voxel, summed."""
    seen = np.zeros(touched.shape, np.int64)
    for axis in range(3):
        seen += np.logical_or.accumulate(touched, axis=axis)
        seen += np.flip(np.logical_or.accumulate(np.flip(touched, axis), axis=axis), axis)
    return np.count_nonzero(~touched & (seen >= least))


@settings(max_examples=100, deadline=None)
@given(
    st.tuples(*[st.integers(1, 9)] * 3), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0),
    st.integers(0, 6),
)  # fmt: skip
def test_same_as_accumulating(shape, seed, share, least):
    touched = np.random.default_rng(seed).random(shape) < share
    assert count_hollow(touched, least) == plain(touched, least)


@pytest.mark.parametrize(("open_sides", "sides"), [(0, 6), (1, 5), (2, 4)])
def test_a_box_sees_its_walls(open_sides, sides):
    touched = np.ones((9, 8, 7), np.bool_)
    touched[1:-1, 1:-1, 1:-1] = False
    touched[1:-1, 1:-1, -1] = open_sides < 1
    touched[1:-1, 1:-1, 0] = open_sides < 2
    # What is inside sees a wall less for each open side, and so do the voxels in the openings.
    assert count_hollow(touched, sides) == 7 * 6 * (5 + open_sides)
    assert count_hollow(touched, sides + 1) == 0
