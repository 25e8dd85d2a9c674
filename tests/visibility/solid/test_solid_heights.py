"""Up to where pixels are solid: whatever stands on what, and by pixels of random boxes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.solids import box
from tests.visibility.solid.test_height_field import at, boxes, field_of, scene

SLAB = [(-3.0, -3.0, -1.0), (30.0, 30.0, 0.0)]
HOUSES = [[(0.0, 0.0, 0.0), (5.5, 9.0, 4.0)], [(5.5, 0.0, 0.0), (11.0, 9.0, 7.0)]]


@pytest.mark.parametrize("ground", [False, True])
@pytest.mark.parametrize("sunk", [0.0, 0.3])
def test_a_slab_lowers_no_wall_between_houses_on_it(ground, sunk):
    houses = np.array(HOUSES)
    houses[:, 0, 2] -= sunk
    field = field_of(boxes(SLAB, *houses), ground=ground)
    assert [at(field, x, 4.5) for x in (-1.5, 3.5, 5.5, 8.5)] == [0.0, 4.0, 4.0, 7.0]
    assert field.lost == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("ground", [False, True])
def test_a_podium_on_a_slab_lowers_nothing_on_it(ground):
    podium = [(-2.0, -2.0, 0.0), (20.0, 20.0, 2.0)]
    houses = np.add(HOUSES, [0.0, 0.0, 2.0])
    beside = [[(22.0, 0.0, 0.0), (25.5, 9.0, 5.0)], [(25.5, 0.0, 0.0), (29.0, 9.0, 5.0)]]
    field = field_of(boxes(SLAB, podium, *houses, *beside), ground=ground)
    assert [at(field, x, 4.5) for x in (5.5, 12.5, 21.5, 25.5)] == [6.0, 2.0, 0.0, 5.0]


@pytest.mark.parametrize("gap", [0.0625, 1.0])
def test_what_floats_over_a_slab_is_not_solid_without_ground(gap):
    house = np.add(HOUSES[0], [0.0, 0.0, gap])
    assert at(field_of(boxes(SLAB, house)), 3.5, 4.5) == 0.0
    assert at(field_of(boxes(SLAB, house), ground=True), 3.5, 4.5) == 4.0 + gap


def test_what_overhangs_a_podium_is_solid_over_it_alone():
    podium = [(0.0, 0.0, 0.0), (6.0, 9.0, 2.0)]
    field = field_of(boxes(podium, [(0.0, 0.0, 2.0), (12.0, 9.0, 5.0)]))
    assert at(field, 3.5, 4.5) == 5.0
    assert at(field, 8.5, 4.5) == -np.inf
    # Nor does it close the gap to what stands on the ground beyond.
    beyond = [(8.5, 0.0, 0.0), (14.0, 9.0, 4.0)]
    field = field_of(boxes(podium, [(0.0, 0.0, 2.0), (12.0, 9.0, 5.0)], beyond))
    assert at(field, 8.5, 4.5) == -np.inf
    assert [at(field, x, 4.5) for x in (10.5, 12.5)] == [5.0, 4.0]


def test_an_open_sheet_below_houses_changes_nothing():
    houses = [box((5.5, 9.0, 4.0)), box((5.5, 9.0, 7.0), low=(5.5, 0.0, 0.0))]
    sheet = box((30.0, 30.0, 0.5), low=(-9.0, -9.0, 0.0), without=(0, 1, 2, 3, 4))
    field = field_of(scene(*houses, sheet), ground=True)
    assert [at(field, x, 4.5) for x in (-1.5, 3.5, 5.5, 8.5)] == [-np.inf, 4.0, 4.0, 7.0]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_no_point_of_a_solid_pixel_is_outside_of_all_boxes_below_its_height(seed, ground):
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 9))
    # On halves and thirds, so that many touch and stand on each other.
    low = np.column_stack([random.integers(0, 16, (count, 2)) / 2, random.integers(0, 4, count)])
    size = np.column_stack([random.integers(1, 16, (count, 2)) / 2, random.integers(1, 5, count)])
    corners = np.stack([low, low + size], axis=1)
    corners[0, 0, 2] = 0.0
    field = field_of(boxes(*corners), 0.75, ground)
    if ground:
        corners[:, 0, 2] = 0.0
    for i, j in np.argwhere(np.isfinite(field.inner)):
        places = field.low + field.cell * (np.array([i, j]) + random.random((40, 2)))
        heights = random.uniform(corners[:, 0, 2].min(), field.inner[i, j], 40)
        points = np.column_stack([places, heights])[:, None]
        assert ((corners[:, 0] <= points) & (points <= corners[:, 1])).all(axis=2).any(axis=1).all()
