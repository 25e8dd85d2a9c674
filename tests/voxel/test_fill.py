"""What the outside reaches, against scipy's component labels."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.fill import fill

SIDES = tuple(product(range(3), (0, -1)))


def grid_of(inside):
    return VoxelGrid(np.array(inside, dtype=np.bool_), np.zeros(3), 1.0)


def filled(inside, closed=()):
    return fill(grid_of(inside), frozenset(closed)).inside


def filled_by_labels(inside, closed=()):
    """All but the 6-connected free components that own a voxel on an open side."""
    labels, _ = ndimage.label(~np.asarray(inside))
    open_labels = {0}
    for axis, end in SIDES:
        if (axis, end) not in closed:
            open_labels |= set(np.unique(np.take(labels, end, axis=axis)))
    outside = np.isin(labels, sorted(open_labels - {0}))
    return ~outside


extent = st.integers(1, 9)
depth = st.sampled_from([1, 2, 7, 63, 64, 65, 100, 127, 128, 129, 193])


@settings(max_examples=120, deadline=None)
@given(
    st.tuples(extent, extent, depth | extent),
    st.floats(0.05, 0.8),
    st.sets(st.sampled_from(SIDES)),
    st.integers(0, 2**32 - 1),
)
def test_random_grids(shape, density, closed, seed):
    inside = np.random.default_rng(seed).random(shape) < density
    before = inside.copy()
    assert np.array_equal(filled(inside, closed), filled_by_labels(inside, closed))
    assert np.array_equal(inside, before)


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 64), (1, 1, 65), (3, 1, 130), (5, 4, 1)])
def test_empty_and_full_grids_stay_as_they_are(shape):
    assert not filled(np.zeros(shape)).any()
    assert filled(np.ones(shape)).all()


@pytest.mark.parametrize("shape", [(3, 4, 70), (5, 5, 5)])
def test_nothing_enters_a_grid_whose_sides_are_all_closed(shape):
    assert filled(np.zeros(shape), SIDES).all()


def shell(shape):
    inside = np.ones(shape, dtype=np.bool_)
    inside[2:-2, 2:-2, 2:-2] = False
    inside[[0, -1]] = inside[:, [0, -1]] = inside[:, :, [0, -1]] = False
    return inside


@pytest.mark.parametrize("shape", [(7, 7, 7), (8, 9, 66), (7, 8, 140)])
def test_closed_shell_becomes_solid_and_a_pierced_one_does_not(shape):
    closed = shell(shape)
    solid = filled(closed)
    assert solid[1:-1, 1:-1, 1:-1].all()
    assert solid.sum() == np.prod(np.array(shape) - 2)
    pierced = closed.copy()
    pierced[3, 3, 1] = False
    assert np.array_equal(filled(pierced), pierced)


def test_a_diagonal_gap_does_not_leak():
    """Faces connect, edges and corners do not."""
    inside = np.zeros((3, 3, 3), dtype=np.bool_)
    for axis, end in SIDES:
        inside[tuple(1 if i != axis else end for i in range(3))] = True
    assert filled(inside)[1, 1, 1]
    assert filled(inside).sum() == 7


@pytest.mark.parametrize(("axis", "end"), SIDES)
def test_open_bowl_is_filled_only_when_it_stands_on_its_closed_side(axis, end):
    """The bowl is a cube shell without the wall on one side."""
    bowl = np.ones((6, 6, 6), dtype=np.bool_)
    bowl[1:-1, 1:-1, 1:-1] = False
    wall = tuple(end if i == axis else slice(1, -1) for i in range(3))
    bowl[wall] = False
    assert np.array_equal(filled(bowl), bowl)
    assert filled(bowl, [(axis, end)]).all()
    others = [side for side in SIDES if side != (axis, end)]
    assert np.array_equal(filled(bowl, others), bowl)


def test_each_side_is_open_by_itself():
    for pair in combinations(SIDES, 2):
        closed = [side for side in SIDES if side not in pair]
        assert not filled(np.zeros((4, 3, 66)), closed).any()


def serpentine(size, width):
    """One corridor that winds through all layers: the longest way a flood can be sent."""
    inside = np.zeros((size, size, width), dtype=np.bool_)
    for x in range(1, size, 2):
        inside[x] = True
        inside[x, 0 if x % 4 == 1 else -1, :] = False
    for x in range(0, size, 2):
        for y in range(1, size, 2):
            inside[x, y] = True
            inside[x, y, 0 if (y + x) % 4 == 1 else -1] = False
    return inside


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_serpentine_maze(axes):
    maze = serpentine(33, 131).transpose(axes)
    for closed in ((), SIDES[:-1], SIDES[1:], SIDES):
        assert np.array_equal(filled(maze, closed), filled_by_labels(maze, closed))


def test_corridor_entered_from_one_end_is_flooded_to_the_other():
    """A single way of 2,000 voxels, up and down through three words of bits."""
    maze = np.ones((1, 25, 150), dtype=np.bool_)
    maze[0, ::2, 1:-1] = False
    for y in range(1, 24, 2):
        maze[0, y, 1 if y % 4 == 1 else -2] = False
    maze[0, 0, 0] = False
    closed = [side for side in SIDES if side != (2, 0)]
    assert np.array_equal(filled(maze, closed), maze)
    maze[0, 0, 0] = True
    assert filled(maze, closed).all()


@pytest.mark.parametrize("seed", range(4))
def test_fill_follows_axis_order_and_mirrors_and_is_idempotent(seed):
    inside = np.random.default_rng(seed).random((9, 11, 70)) < 0.4
    expected = filled(inside)
    assert np.array_equal(filled(inside.transpose(2, 0, 1)), expected.transpose(2, 0, 1))
    assert np.array_equal(filled(inside[::-1, :, ::-1]), expected[::-1, :, ::-1])
    assert np.array_equal(filled(expected), expected)
    assert (expected >= inside).all()


def test_grid_keeps_its_place():
    grid = VoxelGrid(shell((7, 7, 7)), np.array([1.0, 2.0, 3.0]), 0.25)
    result = fill(grid)
    assert result.cell_size == 0.25
    assert np.array_equal(result.origin, grid.origin)
    assert not result.inside.flags.writeable
