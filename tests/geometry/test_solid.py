"""Solid: the shares that warnings and reports are made of."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.solid import Closing, Solid, VoxelGrid


def solid_of(touched, filled, closed_by=()):
    def grid(inside):
        return VoxelGrid(np.asarray(inside, dtype=np.bool_), np.zeros(3), 0.5)

    return Solid(grid(touched), grid(filled), grid(filled), closed_by=closed_by)


def test_shares_of_a_shell():
    touched = np.zeros((10, 6, 6))
    touched[1:5, 1:5, 1:5] = 1
    touched[2:4, 2:4, 2:4] = 0
    filled = touched.copy()
    filled[2:4, 2:4, 2:4] = 1
    solid = solid_of(touched, filled, (Closing("ground", 8),))
    assert solid.inside_fraction == pytest.approx(64 / 360)
    assert solid.enclosed_fraction == pytest.approx(8 / 64)
    assert solid.closed_by == (Closing(by="ground", voxels=8),)


def test_nothing_enclosed():
    flat = np.ones((5, 5, 1))
    assert solid_of(flat, flat).enclosed_fraction == 0.0
    assert solid_of(flat, flat).inside_fraction == 1.0
