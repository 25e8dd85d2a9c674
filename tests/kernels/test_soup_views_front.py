"""Pictures of what is in front, pixel by pixel, and what it costs."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.soup_views import (
    FRONT_ROWS,
    FRONT_STEP,
    draw_soup,
    draw_union,
    empty_pictures,
    remove_useless,
    score_unions,
)
from simplifier.refinement.depths import Depths
from tests.kernels.bits import unpacked
from tests.pictures import sphere_projections

VIEWS = 4
AXES = image_axes(hemisphere_directions(VIEWS))
PROJECTIONS = sphere_projections(AXES, np.zeros(3), 10.0)
SIGNS = np.array([-1.0, 1.0, -1.0, 1.0])
AWAY = np.concatenate([SIGNS[:, None] * AXES[:, 2], np.full((VIEWS, 1), 0.5)], axis=1)
NEAR = 1e-4  # units of depth that single precision may lose


def soup(seed, count):
    return np.random.default_rng(seed).uniform(-5.5, 5.5, (count, 3, 3))


def depths(seed):
    """Limits that change from pixel to pixel, and some pixels where the original does not show."""
    random = np.random.default_rng(seed)
    limits = random.uniform(-6.0, 6.0, (VIEWS, FRONT_ROWS, 64))
    limits[random.random(limits.shape) < 0.2] = -np.inf
    return Depths(AWAY, limits.astype(np.float32))


def drawn(triangles, before):
    images, layers = empty_pictures(len(triangles), VIEWS, 64 + FRONT_ROWS)
    standing = np.zeros(images.shape[1:], np.uint64)
    draw_soup(triangles, PROJECTIONS, before.arrays(), standing, images, layers)
    return images, layers


def plane_depths(triangle, view):
    """(16, 64) of the triangle's plane at the pixels that the limits are of."""
    flat = triangle @ PROJECTIONS[view, :, :3].T + PROJECTIONS[view, :, 3]
    away = triangle @ AWAY[view, :3] + AWAY[view, 3]
    plane = np.linalg.solve(np.concatenate([flat, np.ones((3, 1))], axis=1), away)
    x, y = np.meshgrid(
        np.arange(64) + 0.5, FRONT_STEP * np.arange(FRONT_ROWS) + FRONT_STEP // 2 + 0.5
    )
    return plane[0] * x + plane[1] * y + plane[2]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_pictures_hold_the_pixels_before_the_limits(seed):
    triangles, before = soup(seed, 5), depths(seed)
    images, _ = drawn(triangles, before)
    for index, triangle in enumerate(triangles):
        for view in range(VIEWS):
            shown = unpacked(images[index, view, :64])[FRONT_STEP // 2 :: FRONT_STEP]
            found = unpacked(np.pad(images[index, view, 64:], (0, 48)))[:FRONT_ROWS]
            assert not (found & ~shown).any()
            if shown.any():
                gap = before.limits[view] - plane_depths(triangle, view)
                clear = shown & (np.abs(gap) > NEAR)
                assert np.array_equal(found[clear], gap[clear] > 0.0)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(0, 3000))
def test_each_pixel_in_front_costs_the_toll_once(seed, count, toll):
    """However many triangles stand there."""
    images, layers = drawn(soup(seed, count), depths(seed))
    unions = np.zeros(images.shape[1:], np.uint64)
    draw_union(soup(seed, count), PROJECTIONS, depths(seed).arrays(), unions)
    assert np.array_equal(unions, layers[:, 0])
    assert np.array_equal(unions, np.bitwise_or.reduce(images, axis=0))
    originals = np.random.default_rng(seed).integers(0, 2**63, (VIEWS, 64), dtype=np.uint64)
    fines = np.random.default_rng(seed).integers(0, 900, (VIEWS, 2))
    free = fines * [1, 0]
    scores, without = np.zeros((2, VIEWS), np.int64)
    score_unions(unions, originals, 8, fines, scores)
    score_unions(unions, originals, 8, free, without)
    pixels = np.bitwise_count(unions[:, 64:]).sum(axis=1, dtype=np.int64)
    assert np.array_equal(without - scores, fines[:, 1] * pixels)


def test_a_triangle_that_costs_more_than_it_hides_is_taken_out():
    """It stands in front in one view, where each of its pixels costs more than it hides."""
    wall = np.array([[-5.0, -5.0, 0.0], [5.0, -5.0, 0.0], [0.0, 5.0, 0.0]])
    triangles = np.array([wall, 0.5 * wall - 6.0 * AWAY[0, :3]])
    limits = np.full((VIEWS, FRONT_ROWS, 64), -np.inf, np.float32)
    limits[0] = -4.0
    before = Depths(AWAY, limits)
    images, layers = drawn(triangles, before)
    originals = np.full((VIEWS, 64), ~np.uint64(0))
    for toll, left in ((0, 2), (10**6, 1)):
        fines = np.tile(np.array([0, toll]), (VIEWS, 1))
        scores, kept = np.zeros(VIEWS, np.int64), np.zeros(2, np.bool_)
        score_unions(np.bitwise_or.reduce(images, axis=0), originals, 8, fines, scores)
        remove_useless(images.copy(), layers.copy(), originals, 8, fines, scores, kept)
        assert kept.sum() == left
