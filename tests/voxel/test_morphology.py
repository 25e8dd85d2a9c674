"""Solids grown by whole voxels, against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from simplifier.geometry.grid import VoxelGrid
from simplifier.voxel.morphology import dilated


@pytest.mark.parametrize("reach", [0, 1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_dilated(reach, seed):
    inside = np.random.default_rng(seed).random((5, 8, 6)) < 0.05
    inside[0, 0, 0] = inside[-1, -1, -1] = True
    grown, margin = dilated(VoxelGrid(inside.copy(), np.zeros(3), 1.0), reach)
    assert margin == reach + 1
    around = np.ones((2 * reach + 1,) * 3)
    assert np.array_equal(grown, ndimage.binary_dilation(np.pad(inside, reach + 1), around))
    border = np.ones_like(grown)
    border[1:-1, 1:-1, 1:-1] = False
    assert not (grown & border).any()
