"""Cells on a terrain: from its lowest point there to an eye over its highest."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from tests.visibility.solid.test_terrain import surface, terrain_of


def cells_of(terrain, placing="grid", **chosen):
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", **{"cell_size": 5.0, "eye_height": 1.5, **chosen})
    return upright, place_on_terrain(terrain, upright, placing, options)


def test_they_cover_the_terrain_and_their_tops_are_over_it():
    random = np.random.default_rng(0)
    terrain = terrain_of(random.uniform(50.0, 60.0, (6, 8)), (3.0, 4.0), 2, (1e5, 2e5))
    upright, cells = cells_of(terrain)
    assert len(cells) == 5 * 4
    assert cells.high[:, :2].max(axis=0).tolist() == [21.0, 20.0]
    for x, y in random.random((300, 2)) * [21.0, 20.0]:
        inside = ((cells.low[:, :2] <= [x, y]) & (cells.high[:, :2] >= [x, y])).all(axis=1)
        (cell,) = np.flatnonzero(inside)
        for split in (0, 1):
            height = surface(terrain, x / 3.0, y / 4.0, split) - upright.origin[2]
            assert cells.low[cell, 2] <= height + 1e-4
            assert cells.high[cell, 2] >= height + 1.5 - 1e-4
    assert (cells.high[:, 2] - cells.low[:, 2] <= 11.6).all()


def test_one_walks_where_it_is_not_too_steep():
    heights = np.zeros((5, 9))
    heights[:, 4:] = 30.0
    terrain = terrain_of(heights, (5.0, 5.0), 2)
    _, everywhere = cells_of(terrain)
    _, some = cells_of(terrain, "walkable", cell_size=4.9)
    assert len(everywhere) == 8 * 4
    steep = (some.low[:, 0] > 15.0) & (some.high[:, 0] < 20.0)
    assert not steep.any()
    assert len(some) > 20
    flat = terrain_of(np.outer(np.ones(4), [0.0, 9.0, 0.0, 9.0]), tile=2)
    with pytest.raises(OptionError, match="--cells grid"):
        cells_of(flat, "walkable")


def test_holes_have_no_cells_and_slivers_are_none():
    heights = np.zeros((5, 5))
    heights[1:4, 1:4] = np.nan
    heights[3, 3] = 0.0
    terrain = terrain_of(heights, (5.0, 5.0), 2)
    _, cells = cells_of(terrain, cell_size=4.999)
    # The only square is the south-eastern one, and the second cell from below just touches it.
    assert cells.high[:, 1].round(3).tolist() == [4.999, 9.998]
    lonely = np.full((9, 9), np.nan)
    lonely[:3, :3] = 0.0
    assert len(cells_of(terrain_of(lonely, (5.0, 5.0)), cell_size=10.0)[1]) < 16
    with pytest.raises(OptionError, match="or more"):
        cells_of(terrain, cell_size=1e-4)
