"""Voxels barred by regions that are to be left open."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.overrides import Region
from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.core import SLACK, barred_voxels, open_regions

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def full(shape=(6, 5, 4), origin=(10.0, -3.0, 2.0), cell=0.5):
    return VoxelGrid(np.ones(shape, dtype=np.bool_), np.array(origin), cell)


def in_grid(grid, low, high):
    """A region by its corners in grid space."""
    low, high = grid.to_world(np.array(low, float)), grid.to_world(np.array(high, float))
    return Region.of((low + high) / 2.0, high - low, LEVEL)


def test_the_voxels_of_a_region_are_barred_and_no_others():
    grid = full()
    found = barred_voxels(grid, [in_grid(grid, (1.5, 1.5, 1.5), (3.5, 2.5, 2.5))])
    expected = np.zeros(grid.shape, dtype=np.bool_)
    expected[1:4, 1:3, 1:3] = True
    assert np.array_equal(found, expected)
    assert np.array_equal(
        open_regions(grid, [in_grid(grid, (0, 0, 0), (9, 9, 9))]).inside.any(), False
    )
    assert open_regions(grid, []) is grid


def test_a_region_flush_with_voxels_bars_those_that_it_touches_too():
    grid = full()
    found = barred_voxels(grid, [in_grid(grid, (2, 2, 1), (3, 3, 2))])
    assert np.argwhere(found).min(axis=0).tolist() == [1, 1, 0]
    assert np.argwhere(found).max(axis=0).tolist() == [3, 3, 2]
    apart = 2.0 * SLACK
    inner = in_grid(grid, (2 + apart, 2 + apart, 1 + apart), (3 - apart, 3 - apart, 2 - apart))
    assert np.argwhere(barred_voxels(grid, [inner])).tolist() == [[2, 2, 1]]


def test_a_margin_has_the_voxels_around_the_grid():
    grid = full()
    region = in_grid(grid, (-1.5, 1.5, 1.5), (0.5, 1.6, 1.6))
    assert np.argwhere(barred_voxels(grid, [region], 2)).tolist() == [
        [0, 3, 3],
        [1, 3, 3],
        [2, 3, 3],
    ]


def test_a_region_far_away_or_around_everything_is_no_trouble():
    grid = full()
    assert not barred_voxels(grid, [in_grid(grid, (1e6, 0, 0), (2e6, 1, 1))], 1).any()
    assert barred_voxels(grid, [in_grid(grid, (-1e6, -1e6, -1e6), (1e6, 1e6, 1e6))], 1).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_every_voxel_with_a_point_of_a_turned_region_is_barred(seed):
    generator = np.random.default_rng(seed)
    grid = full((9, 8, 7))
    region = Region.of(
        grid.to_world(generator.uniform(0, 8, 3)), generator.uniform(0.05, 2, 3),
        generator.normal(size=4),
    )  # fmt: skip
    found = barred_voxels(grid, [region])
    points = region.centre + (generator.uniform(-1, 1, (2000, 3)) * region.half) @ region.axes
    places = np.floor(grid.to_grid(points)).astype(int)
    within = ((places >= 0) & (places < grid.shape)).all(axis=1)
    assert found[tuple(places[within].T)].all()
    half_diagonal = 0.5 * np.sqrt(3.0) * grid.cell_size * (1.0 + 2.0 * SLACK)
    centres = grid.to_world(np.argwhere(found) + 0.5)
    reach = np.abs((centres - region.centre) @ region.axes.T)
    assert (reach <= region.half + half_diagonal + 1e-9).all()
