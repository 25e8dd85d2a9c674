"""Solids grown by whole voxels, against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.morphology import dilate, glue_neighbours


@pytest.mark.parametrize("reach", [0, 1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_dilated(reach, seed):
    inside = np.random.default_rng(seed).random((5, 8, 6)) < 0.05
    inside[0, 0, 0] = inside[-1, -1, -1] = True
    grown, margin = dilate(VoxelGrid(inside.copy(), np.zeros(3), 1.0), reach)
    assert margin == reach + 1
    around = np.ones((2 * reach + 1,) * 3)
    assert np.array_equal(grown, ndimage.binary_dilation(np.pad(inside, reach + 1), around))
    border = np.ones_like(grown)
    border[1:-1, 1:-1, 1:-1] = False
    assert not (grown & border).any()


@pytest.mark.parametrize("seed", range(4))
def test_glued(seed):
    shape = tuple(np.random.default_rng(seed).integers(1, 9, 3))
    inside = np.random.default_rng(seed).random(shape) < 0.1
    grid = VoxelGrid(inside, np.array([1.0, 2.0, 3.0]), 0.5)
    grown = glue_neighbours(grid)
    expected = ndimage.binary_dilation(inside, np.ones((3, 3, 3)))
    np.testing.assert_array_equal(grown.inside, expected)
    assert grown.inside.flags.c_contiguous
    assert (grown.origin == grid.origin).all()
    assert grown.cell_size == grid.cell_size
