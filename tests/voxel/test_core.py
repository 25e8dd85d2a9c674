"""Voxels wholly inside and deep inside, against all pairs of voxels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.core import core, deepest
from simplifier.voxel.fill import fill
from simplifier.voxel.voxelize import voxelize
from tests.solids import blob

GROUND = frozenset({(1, 0)})
NOTHING = frozenset()
ON_THE_GRID = np.zeros(3)


def grid_of(inside):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0)


def core_of(touched, filled, shrink=0.0, sides=NOTHING, lowest=ON_THE_GRID):
    return core(grid_of(touched), grid_of(filled), shrink, lowest, sides).inside


def by_all_pairs(enclosed, shrink, ground):
    """Voxels no point of which is nearer than ``shrink`` to a point of another, padded, voxel."""
    padded = np.pad(enclosed, 1)
    padded[:, 0] = ground
    away = np.abs(np.argwhere(padded)[:, None] - np.argwhere(~padded)[None])
    gaps = np.sqrt((np.maximum(away - 1, 0) ** 2).sum(axis=2)).min(axis=1)
    deep = np.zeros_like(padded)
    deep[tuple(np.argwhere(padded)[gaps >= shrink - 1e-9].T)] = True
    return deep[1:-1, 1:-1, 1:-1]


@settings(max_examples=60)
@given(
    st.tuples(*[st.integers(1, 8)] * 3),
    st.floats(0.6, 0.99),
    st.sampled_from([0.0, 0.5, 1.0, 1.4, 2.0, 2.5]),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_all_pairs(shape, density, shrink, ground, seed):
    enclosed = np.random.default_rng(seed).random(shape) < density
    sides = GROUND if ground else NOTHING
    found = core_of(np.zeros(shape), enclosed, shrink, sides)
    assert np.array_equal(found, by_all_pairs(enclosed, shrink, ground))


@pytest.fixture(scope="module")
def solid():
    touched = voxelize(blob(), 32)
    return touched, fill(touched)


def test_without_shrink_it_is_what_is_enclosed(solid):
    touched, filled = solid
    found = core(touched, filled, 0.0, ON_THE_GRID, NOTHING)
    assert np.array_equal(found.inside, filled.inside & ~touched.inside)
    assert found.count > 1000


def test_a_larger_shrink_never_adds_a_voxel(solid):
    last = core(*solid, 0.0, ON_THE_GRID, NOTHING).inside
    for shrink in np.linspace(0.05, 14.0, 40):
        here = core(*solid, float(shrink), ON_THE_GRID, NOTHING).inside
        assert (here <= last).all()
        last = here
    assert not last.any()


def test_a_shrink_below_a_voxel_takes_the_outer_layer(solid):
    """Voxels that touch are at no distance, so any shrink at all parts them."""
    whole = core(*solid, 0.0, ON_THE_GRID, NOTHING)
    less = core(*solid, 1e-6, ON_THE_GRID, NOTHING)
    assert 0 < less.count < whole.count
    assert np.array_equal(less.inside, core(*solid, 1.0, ON_THE_GRID, NOTHING).inside)


def test_deepest(solid):
    most = deepest(*solid, NOTHING)
    assert core(*solid, most, ON_THE_GRID, NOTHING).count > 0
    assert core(*solid, most + 0.01, ON_THE_GRID, NOTHING).count == 0
    touched, _ = solid
    assert deepest(touched, touched, NOTHING) == 0.0


def test_the_ground_is_solid_all_the_way_down():
    filled = np.ones((9, 6, 9))
    assert core_of(np.zeros_like(filled), filled, 3.0, GROUND)[4, 0, 4]
    assert not core_of(np.zeros_like(filled), filled, 3.0)[4, 0, 4]


def test_a_voxel_that_reaches_under_the_mesh_is_not_wholly_inside():
    filled = np.ones((4, 4, 4))
    lifted = core_of(np.zeros_like(filled), filled, 0.0, GROUND, np.array([0.3, 0.3, 0.3]))
    assert not lifted[:, 0].any()
    assert lifted[:, 1:].all()
    assert core_of(np.zeros_like(filled), filled, 0.0, GROUND).all()
