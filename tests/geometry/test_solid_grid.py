"""VoxelGrid: its two spaces, and that its solid cannot be changed in place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid


def grid_of(inside, origin=(0.0, 0.0, 0.0), cell_size=1.0):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.array(origin), cell_size)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e6), st.floats(-1e6, 1e6))
def test_there_and_back(seed, cell_size, offset):
    grid = grid_of(np.ones((2, 3, 4)), (offset, -offset, 3.0), cell_size)
    points = np.random.default_rng(seed).uniform(-5.0, 70.0, (40, 3))
    rounding = 1e-9 + 1e-15 * abs(offset) / cell_size * 10
    assert grid.to_grid(grid.to_world(points)) == pytest.approx(points, abs=rounding)


def test_corners_of_a_voxel():
    grid = grid_of(np.ones((2, 3, 4)), (10.0, 20.0, 30.0), 0.5)
    assert grid.to_world(np.array([1.0, 2.0, 3.0])).tolist() == [10.5, 21.0, 31.5]
    assert grid.to_grid(np.array([[10.5, 21.0, 31.5]])).tolist() == [[1.0, 2.0, 3.0]]
    assert grid.to_world(np.zeros((2, 5, 3))).shape == (2, 5, 3)


def test_shape_and_count():
    inside = np.zeros((2, 3, 4))
    inside[1, 2, 3] = inside[0, 0, 0] = 1
    assert grid_of(inside).shape == (2, 3, 4)
    assert grid_of(inside).count == 2


def test_the_solid_is_read_only():
    grid = grid_of(np.ones((2, 2, 2)))
    with pytest.raises(ValueError, match="read-only"):
        grid.inside[0, 0, 0] = False


def test_another_solid_in_the_same_place():
    grid = grid_of(np.ones((2, 2, 2)), (1.0, 2.0, 3.0), 0.25)
    other = grid.with_inside(np.zeros((2, 2, 2), dtype=np.bool_))
    assert (grid.count, other.count) == (8, 0)
    assert other.origin is grid.origin
    assert other.cell_size == grid.cell_size
