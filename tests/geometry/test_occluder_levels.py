"""Levels by distance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.errors import OptionError
from simplifier.geometry.camera import Lens
from simplifier.geometry.occluder import Level, LodChain, Occluder


def chain(*bounds, **others):
    levels = tuple(
        Level(Occluder(np.zeros((0, 3)), np.zeros((0, 3), np.int32), bound), 8, 0.5 * bound)
        for bound in bounds
    )
    return LodChain(levels, **others)


def test_a_figure_by_hand():
    """At 90 degrees half of the screen is as high as it is far: 500 pixels a unit at distance 1."""
    made = chain(0.01, 0.1, lens=Lens(1000, 90.0), pixel_error=2.0)
    assert made.switch_distance(0) == pytest.approx(2.5)
    assert made.switch_distance(1) == pytest.approx(25.0)
    assert made.switch_distance(1, pixels=4.0) == pytest.approx(12.5)
    assert made.switch_distance(1, Lens(2000, 90.0)) == pytest.approx(50.0)


def test_nearer_than_any_the_finest_is_used():
    made = chain(0.01, 0.1)
    assert made.at(0.0) is made.levels[0]
    assert made.at(math.inf) is made.levels[1]


def test_a_promise_of_nothing_is_for_no_distance():
    made = chain(0.01, math.inf)
    assert made.at(1e300) is made.levels[0]


@given(
    st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=6).map(sorted),
    st.floats(0.0, 1e6),
    st.floats(0.1, 50.0),
    st.integers(100, 4000),
    st.floats(5.0, 170.0),
)
def test_the_coarsest_within_the_pixels(bounds, distance, pixels, rows, fov):
    made, lens = chain(*bounds), Lens(rows, fov)
    good = [
        level
        for index, level in enumerate(made.levels)
        if made.switch_distance(index, lens, pixels) <= distance
    ]
    assert made.at(distance, lens, pixels) is (good[-1] if good else made.levels[0])
    for level in good:  # and so they are: a length at a distance, in pixels
        assert level.error_bound * lens.focal <= pixels * distance * (1.0 + 1e-12)


@pytest.mark.parametrize(
    ("arguments", "named", "name"),
    [
        ((100.0,), {"pixels": -1.0}, "pixels"),
        ((100.0,), {"pixels": 0}, "pixels"),
        ((math.nan,), {}, "distance"),
        ((-5.0,), {}, "distance"),
        (("x",), {}, "distance"),
        ((100.0, 60), {}, "lens"),
    ],
)
def test_what_is_no_distance_no_lens_and_no_error_is_refused(arguments, named, name):
    """A level came back for an error of minus one pixel."""
    with pytest.raises(OptionError, match=f"^{name}: "):
        chain(0.01, 0.1).at(*arguments, **named)


@pytest.mark.parametrize("index", [-1, 2, 99, 0.5])
def test_a_level_that_is_not_there_has_no_distance(index):
    with pytest.raises(OptionError, match=r"^index: "):
        chain(0.01, 0.1).switch_distance(index)
