"""The smallest hole: openings on both sides of the limit, wherever and however they lie."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.geometry.solid import VoxelGrid
from simplifier.voxel.fill import OPEN_ABOVE, close_holes, fill
from simplifier.voxel.voxelize import voxelize
from tests.solids import box, joined, turned

GROUND = frozenset({(1, 0)})
RESOLUTION = 40
CENTRE = np.array([0.5, 0.5, 0.5])

OFFSETS = [(0.0, 0.0), (0.31, 0.5), (0.5, 0.83), (0.77, 0.12)]  # voxels

TURNS = {
    "aligned": np.eye(3),
    "about y": np.linalg.qr(np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]))[0],
    "any": np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0],
    "diagonal": np.linalg.qr(np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 0.0], [1.0, 1.0, -2.0]]))[0],
}


def sheet(x0, x1, z0, z1):
    """A level rectangle at the top of the unit box."""
    return box((x1 - x0, 0.0, z1 - z0), (x0, 1.0, z0), without=[0, 1, 2, 4, 5])


def pierced(width, kind, offset=(0.0, 0.0)):
    """A unit box whose lid has a square hole or a slot of that width near its middle."""
    x, z = 0.5 + np.array(offset) / RESOLUTION
    x0, x1, z0, z1 = x - width / 2, x + width / 2, z - width / 2, z + width / 2
    if kind == "slot":
        lid = [sheet(0, x0, 0, 1), sheet(x1, 1, 0, 1)]
    else:
        lid = [sheet(0, x0, 0, 1), sheet(x1, 1, 0, 1), sheet(x0, x1, 0, z0), sheet(x0, x1, z1, 1)]
    return joined(box(without=[3]), *lid)


def deep(grid, turn, depth):
    """Voxels of the box whose points are all at least ``depth`` voxels inside of it."""
    centres = np.stack(np.indices(grid.shape), axis=-1) + 0.5
    at_home = grid.to_world(centres) @ turn
    inset = depth * grid.cell_size + 0.5 * math.sqrt(3.0) * grid.cell_size
    return ((at_home > inset) & (at_home < 1.0 - inset)).all(axis=-1)


def holds(grid, turn, point):
    return bool(grid.inside[tuple(np.floor(grid.to_grid(turn @ point)).astype(int))])


@pytest.mark.sweep(5)
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", ["slot", "hole"])
@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("width", [0.6, 1.2, 3.2, 5.2, 5.7])
def test_narrower_openings_are_closed(width, offset, kind, turn):
    cell = float(turned(box(), TURNS[turn]).extent.max()) / RESOLUTION
    touched = voxelize(turned(pierced(0.999 * width * cell, kind, offset), TURNS[turn]), RESOLUTION)
    assert touched.cell_size == pytest.approx(cell)
    closed = close_holes(touched, width)
    inner = deep(touched, TURNS[turn], math.sqrt(width**2 + 1.0) / 2.0)
    assert inner.sum() > 500
    assert (closed.inside >= inner).all()
    if width > 3.0:
        assert not (fill(touched).inside & inner).any()  # else it would have been closed anyway


@pytest.mark.sweep(5)
@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("kind", ["slot", "hole"])
@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("width", [0.6, 1.2, 3.2, 5.2, 5.7])
def test_wider_openings_stay_open(width, offset, kind, turn):
    cell = float(turned(box(), TURNS[turn]).extent.max()) / RESOLUTION
    opening = 1.001 * (width + OPEN_ABOVE) * cell
    touched = voxelize(turned(pierced(opening, kind, offset), TURNS[turn]), RESOLUTION)
    assert not holds(close_holes(touched, width), TURNS[turn], CENTRE)


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("width", [1.0, 3.0, 5.7])
def test_slots_along_the_grid_stay_open_from_three_voxels_more(width, offset):
    opening = (math.sqrt(width**2 + 1.0) + 3.001) / RESOLUTION
    touched = voxelize(pierced(opening, "slot", offset), RESOLUTION)
    assert not holds(close_holes(touched, width), np.eye(3), CENTRE)


def test_the_longer_side_of_a_slot_does_not_matter():
    """A ball is as wide as it is long: a slot is as narrow as its narrow side."""
    touched = voxelize(pierced(4.0 / RESOLUTION, "slot"), RESOLUTION)
    assert holds(close_holes(touched, 4.0), np.eye(3), CENTRE)


def floating(gap):
    """A box without floor above two thin rails that stand on the ground."""
    rails = [box((1.0, gap, 0.02), (0.0, 0.0, z)) for z in (-0.5, 1.5)]
    return joined(box((1.0, 1.0, 1.0), (0.0, gap, 0.0), without=[2]), *rails)


def test_a_gap_above_the_ground_is_an_opening():
    touched = voxelize(floating(0.3), RESOLUTION)
    point = np.array([0.5, 0.8, 0.5])
    narrow, wide = touched.in_voxels(0.31), touched.in_voxels(0.08)
    assert not holds(fill(touched, GROUND), np.eye(3), point)
    assert holds(close_holes(touched, narrow, GROUND), np.eye(3), point)
    assert not holds(close_holes(touched, wide, GROUND), np.eye(3), point)
    assert not holds(close_holes(touched, narrow), np.eye(3), point)  # no ground, no gap


def by_plain_steps(inside, width, ground):
    """The same by all pairs of voxels and scipy's labels."""
    limit = width * width + 1.0 + 1e-6
    margin = math.ceil(math.sqrt(limit) / 2.0) + 2
    walls = np.pad(inside, margin)
    if ground:
        walls[:, :margin] = True
    near = reached_from(walls, limit)
    labels, _ = ndimage.label(~near)
    outside = labels == labels[0, -1, 0]
    swept = reached_from(outside, limit)
    return ~swept[margin:-margin, margin:-margin, margin:-margin]


def reached_from(sites, limit):
    """Voxels whose centre is within sqrt(limit) / 2 of a site's cube, or the other way round."""
    reach = math.ceil(math.sqrt(limit) / 2.0 + 0.5)
    offsets = np.stack(np.indices((2 * reach + 1,) * 3), axis=-1) - reach
    ball = (np.maximum(2 * np.abs(offsets) - 1, 0) ** 2).sum(axis=-1) <= limit
    return ndimage.binary_dilation(sites, ball)


@settings(max_examples=40)
@given(
    st.tuples(*[st.integers(2, 12)] * 3),
    st.floats(0.02, 0.3),
    st.floats(0.1, 6.0),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
def test_plain_steps(shape, density, width, ground, seed):
    inside = np.random.default_rng(seed).random(shape) < density
    grid = VoxelGrid(inside, np.zeros(3), 1.0)
    closed = close_holes(grid, width, GROUND if ground else frozenset()).inside
    assert np.array_equal(closed, by_plain_steps(inside, width, ground))
    assert (closed >= inside).all()


@pytest.mark.parametrize("width", [0.5, 2.0, 5.0])
def test_a_closed_convex_solid_stays_as_it_is(width):
    touched = voxelize(box((1.0, 0.6, 0.8)), 24)
    assert np.array_equal(close_holes(touched, width).inside, fill(touched).inside)


def test_two_voxels_apart_is_no_solid():
    """What is added beside a surface is no further from it than the limit says."""
    far = joined(box((0.2, 1, 1)), box((0.2, 1, 1), (0.8, 0, 0)))
    touched = voxelize(far, 40)
    closed = close_holes(touched, 8.0)
    assert np.array_equal(closed.inside, fill(touched).inside)
