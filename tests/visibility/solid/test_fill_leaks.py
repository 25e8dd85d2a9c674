"""Holes of houses: where they are, and how wide."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.visibility.solid.fill_leaks import narrowest
from tests.visibility.sheets import house, house_with_hole, post
from tests.visibility.solid.test_viewer_fill import AROUND, filled_of


def test_the_widest_way_is_measured_where_it_is_narrowest():
    touched = np.zeros((20, 20, 20), dtype=bool)
    touched[10] = True
    touched[10, 4:7, 4:7] = False  # 3 wide
    touched[10, 12, 12] = False
    inside, outside = np.zeros_like(touched), np.zeros_like(touched)
    inside[:5], outside[16:] = True, True
    place, width = narrowest(touched, inside, outside, grounded=False)
    assert place == pytest.approx([10.5, 5.5, 5.5])
    assert width == pytest.approx(4.0)  # to the middles of what is touched
    touched[10] = True
    assert narrowest(touched, inside, outside, grounded=False) is None


@pytest.mark.parametrize(
    ("hole", "width"),
    [((-1, 1, 3, 5), 2.0), ((-8, -4, 2, 3.5), 1.5), ((2.2, 5.3, 4.1, 7.2), 3.1), ((1, 4, 0, 2), 2)],
)
def test_a_hole_is_found_where_it_is_and_as_wide(hole, width):
    filled, _ = filled_of(house_with_hole(hole=hole) | post(), AROUND)
    (leak,) = filled.leaks
    assert filled.leak_count == 1
    y0, y1, z0, z1 = hole
    assert leak.name == "holed west"
    assert leak.point[0] == pytest.approx(20.0, abs=0.3)
    assert y0 <= leak.point[1] <= y1
    assert z0 <= leak.point[2] <= z1
    assert leak.width == pytest.approx(width, abs=0.5)
    assert np.array(leak.size) == pytest.approx([16.0, 20.0, 9.0], abs=2.0)


def test_nothing_leaks_that_is_closed_wide_open_or_lived_in():
    closed = house("house", (20.0, -10.0, 0.0), (36.0, 10.0, 9.0))
    assert not filled_of(closed | post(), AROUND)[0].leaks
    arcade = house("house", (20.0, -10.0, 0.0), (36.0, 10.0, 9.0), ("floor", "west", "east"))
    assert not filled_of(arcade | post(), AROUND)[0].leaks
    guest = np.array([[25.0, -3.0, 0.0], [28.0, 0.0, 2.0]])
    assert not filled_of(house_with_hole() | post(), [*AROUND, guest])[0].leaks
