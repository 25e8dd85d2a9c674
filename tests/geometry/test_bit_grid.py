"""BitGrid, against arrays of booleans."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.bit_grid import BitGrid
from simplifier.geometry.solid import VoxelGrid

SHAPES = st.tuples(st.integers(1, 6), st.integers(1, 6), st.integers(1, 150))


def random_voxels(shape, seed):
    generator = np.random.default_rng(seed)
    return generator.random(shape) < generator.random()


@given(SHAPES, st.integers(0, 999))
def test_bits_are_the_voxels(shape, seed):
    voxels = random_voxels(shape, seed)
    grid = BitGrid.of(voxels)
    assert grid.shape == shape
    assert grid.count == np.count_nonzero(voxels)
    assert np.array_equal(grid.voxels, voxels)
    for x, y, z in np.argwhere(voxels)[:5]:
        assert grid.words[x, y, z // 64] >> np.uint64(z % 64) & np.uint64(1) == 1


@given(SHAPES, st.integers(0, 999))
def test_voxels_are_listed_in_order_and_know_their_neighbours_along_z(shape, seed):
    voxels = random_voxels(shape, seed)
    grid = BitGrid.of(voxels)
    assert np.array_equal(grid.places, np.argwhere(voxels))
    padded = np.pad(voxels, ((0, 0), (0, 0), (1, 1)))
    for words, expected in ((grid.follow, padded[:, :, :-2]), (grid.precede, padded[:, :, 2:])):
        assert np.array_equal(BitGrid(words, grid.depth).voxels, expected)


@given(SHAPES, st.integers(0, 999))
def test_sets_of_voxels_are_joined_as_booleans_are(shape, seed):
    left, right = random_voxels(shape, seed), random_voxels(shape, seed + 1)
    some, others = BitGrid.of(left), BitGrid.of(right)
    for found, expected in (
        (some & others, left & right),
        (some | others, left | right),
        (some - others, left & ~right),
        (~some, ~left),
        (~~some, left),
        (BitGrid.empty(shape), np.zeros(shape, dtype=np.bool_)),
    ):
        assert np.array_equal(found.voxels, expected)
        assert found.count == np.count_nonzero(expected)  # none past the last voxel


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_grid_of_bits_is_one_of_booleans(order):
    voxels = np.asarray(random_voxels((3, 4, 70), 5), order=order)
    of_booleans = VoxelGrid(voxels, np.zeros(3), 0.5)
    of_bits = of_booleans.with_inside(of_booleans.bits)
    assert of_bits.shape == of_booleans.shape == (3, 4, 70)
    assert of_bits.count == of_booleans.count == np.count_nonzero(voxels)
    assert np.array_equal(of_bits.inside, voxels)
    assert of_bits.inside is of_bits.inside
    for grid in (of_bits, of_booleans):
        with pytest.raises(ValueError, match="read-only"):
            grid.inside[0, 0, 0] = True
