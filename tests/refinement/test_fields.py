"""Fields of cells against scipy's images, which do the same and take longer to load."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.refinement.fields import GAUSSIAN, depths_in, smoothed

seeds = st.integers(0, 10_000)


def some_field(seed, most=12):
    random = np.random.default_rng(seed)
    return random, random.random(tuple(random.integers(1, most, 3)))


@given(seed=seeds)
def test_averages_are_scipys_to_the_last_bit(seed):
    _, field = some_field(seed)
    expected = field
    for axis in range(3):
        expected = ndimage.convolve1d(expected, [0.25, 0.5, 0.25], axis=axis, mode="constant")
    assert np.array_equal(smoothed(field, (0.5, 0.25), "constant"), expected)
    assert np.array_equal(smoothed(field, GAUSSIAN, "symmetric"), ndimage.gaussian_filter(field, 1))


@given(seed=seeds, share=st.floats(0.0, 1.0))
def test_depths_are_exact(seed, share):
    _, field = some_field(seed)
    cells = field < share
    expected = ndimage.distance_transform_edt(np.pad(cells, 1))[1:-1, 1:-1, 1:-1]
    assert np.array_equal(depths_in(cells), expected)


def test_a_field_of_one_value_stays_what_it_is():
    field = np.full((3, 1, 4), 7.0)
    assert smoothed(field, GAUSSIAN, "symmetric") == pytest.approx(field)
