"""Distances that are no whole numbers, and meshes that lie on the ground but for rounding."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.overrides import Region
from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.core import barred_voxels, core, deepest
from simplifier.voxel.fill import Side

GROUND: frozenset[Side] = frozenset({(1, 0)})
NOTHING: frozenset[Side] = frozenset()


def grid_of(inside: np.ndarray) -> VoxelGrid:
    return VoxelGrid(np.asarray(inside, dtype=np.bool_), np.zeros(3), 1.0)


def test_the_deepest_shrink_leaves_a_voxel_whatever_its_root_rounds_to() -> None:
    depths = set()
    for seed in range(40):
        rng = np.random.default_rng(seed)
        inside = np.ones((14, 14, 14), dtype=np.bool_)
        inside[tuple(rng.integers(0, 14, (3, 30)))] = False
        touched, filled = grid_of(np.zeros_like(inside)), grid_of(inside)
        most = deepest(touched, filled, NOTHING)
        depths.add(round(4.0 * most**2))
        assert core(touched, filled, most, np.zeros(3), NOTHING).count > 0
        assert core(touched, filled, most * (1.0 + 1e-6), np.zeros(3), NOTHING).count == 0
    assert len(depths) >= 5


@pytest.mark.parametrize(("low", "kept"), [(0.0, True), (1e-12, True), (1e-6, False)])
def test_a_mesh_lifted_by_rounding_lies_on_the_ground(low: float, kept: bool) -> None:
    touched, filled = grid_of(np.zeros((4, 4, 4))), grid_of(np.ones((4, 4, 4)))
    found = core(touched, filled, 0.0, np.full(3, low), GROUND).inside
    assert found[:, 0].all() == found[:, 0].any() == kept
    assert found[:, 1:].all()


@pytest.mark.parametrize("margin", [0, 1, 3])
def test_barred_voxels_have_the_margin_on_both_sides(margin: int) -> None:
    grid = grid_of(np.ones((5, 6, 7)))
    here = Region.of(np.full(3, 2.5), np.full(3, 0.5), np.array([0.0, 0.0, 0.0, 1.0]))
    found = barred_voxels(grid, [here], margin)
    assert found.shape == (5 + 2 * margin, 6 + 2 * margin, 7 + 2 * margin)
    assert np.argwhere(found).tolist() == [[2 + margin] * 3]
