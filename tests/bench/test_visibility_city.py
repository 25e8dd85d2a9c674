"""The generated city is what it says, and its street cells touch nothing."""

from __future__ import annotations

import numpy as np
import pytest

from bench.visibility_city import MOST, PITCH, generated_city, street_cells


def test_the_whole_city_is_as_large_as_that_of_the_paper():
    city = generated_city()
    blocks = {name.rpartition(" building")[0] for name in city.names}
    assert len(blocks) == pytest.approx(1957, abs=20)
    assert len(city) == pytest.approx(11_756, abs=200)
    assert len(set(city.names)) == len(city)
    tops = city.bounds()[:, 1, 2]
    assert np.count_nonzero(tops > 30.0) == pytest.approx(0.01 * len(city), rel=0.3)
    assert tops.max() <= 90.0


def test_buildings_fill_their_block_without_overlap_and_share_walls():
    city = generated_city(6, seed=3)
    boxes = city.bounds()
    assert (boxes.astype(np.float32) == boxes).all()
    plans = boxes[:, :, :2]
    sides = plans[:, 1] - plans[:, 0]
    assert (sides > 2.0).all()
    of_block: dict[str, list[int]] = {}
    for index, name in enumerate(city.names):
        of_block.setdefault(name.rpartition(" building")[0], []).append(index)
    for members in of_block.values():
        assert 4 <= len(members) <= MOST
        whole = plans[members, 1].max(axis=0) - plans[members, 0].min(axis=0)
        assert (whole >= PITCH - 20.1).all()
        assert (whole <= PITCH - 11.9).all()
        assert np.prod(sides[members], axis=1).sum() == whole.prod()
    inner = plans[:, None, 0] < plans[None, :, 1]
    crossing = (inner & inner.transpose(1, 0, 2)).all(axis=2)
    assert (crossing == np.eye(len(city), dtype=bool)).all()


def test_street_cells_touch_no_building_and_are_spread_over_the_city():
    city = generated_city(12)
    cells = street_cells(city, 60)
    assert (cells.high - cells.low == [10.0, 10.0, 2.0]).all()
    plans = city.bounds()[:, :, :2]
    apart = (plans[:, None, 0] > cells.high[:, :2]) | (plans[:, None, 1] < cells.low[:, :2])
    assert apart.any(axis=2).all()
    quarters = (cells.low[:, :2] > 6 * PITCH) @ [1, 2]
    assert (np.bincount(quarters, minlength=4) > 5).all()
    assert np.array_equal(street_cells(city, 60).low, cells.low)
    with pytest.raises(ValueError, match="too narrow"):
        street_cells(generated_city(2), 1, size=30.0)
