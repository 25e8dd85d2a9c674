"""What a point sees of a terrain, against lines that are sampled closely."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.visibility.checking.terrain_view import terrain_seen_from
from tests.visibility.solid.test_terrain import surface, terrain_of

SPACING = (3.0, 2.0)


def sampled(terrain, eye, angle, rise, step=0.002):
    """Tiles that come up along an azimuth by more than ``rise`` over the steepest line so far."""
    size = np.array(terrain.known.shape)
    t = np.arange(step, 60.0, step)
    way = np.array([np.cos(angle), np.sin(angle)]) / terrain.elevation.spacing
    x, y = (eye[:2] / terrain.elevation.spacing)[:, None] + t * way[:, None]
    inside = (x >= 0.0) & (x < size[0]) & (y >= 0.0) & (y < size[1])
    x, y, t = x[inside], y[inside], t[inside]
    c, r = x.astype(int), y.astype(int)
    slopes = np.where(terrain.known[c, r], (surface(terrain, x, y, 0) - eye[2]) / t, -np.inf)
    steepest = np.concatenate([[-np.inf], np.maximum.accumulate(slopes)[:-1]])
    up = (slopes > steepest + rise / t) & np.isfinite(slopes)
    rows = (size[1] - 1 - r[up]) // terrain.tile
    return set(terrain.numbers[c[up] // terrain.tile, rows].tolist())


@pytest.mark.parametrize("seed", range(4))
def test_each_azimuth_sees_what_rises_along_it(seed):
    random = np.random.default_rng(seed)
    heights = random.uniform(0.0, 6.0, (9, 8))
    if seed % 2:
        heights[3, 4] = heights[6, 1] = np.nan
    terrain = terrain_of(heights, SPACING, 2)
    eye = np.array([*(random.uniform(0.2, 0.8, 2) * [21.0, 16.0]), 7.0])
    # One direction at a time: the first of one even direction, and no goals that are hidden.
    known = terrain_seen_from(terrain, eye[None], 40)[0]
    angles = (np.arange(40) + 0.5 * (np.sqrt(5.0) - 1.0)) * 2.0 * np.pi / 40
    strictly, loosely = set(), set()
    for angle in angles:
        strictly |= sampled(terrain, eye, angle, 0.02)
    for angle in known[~np.isnan(known)]:
        loosely |= sampled(terrain, eye, angle, 0.0)
    seen = set(np.flatnonzero(~np.isnan(known)).tolist())
    # A piece that is shorter than a step of the samples may be missed by them.
    assert len(strictly - seen) == 0
    assert seen <= loosely
    assert len(seen) > 5


def test_a_ridge_hides_the_valley_behind_it_from_low_eyes_alone():
    heights = np.zeros((9, 17))
    heights[:, 8] = 20.0
    terrain = terrain_of(heights, (10.0, 10.0), 4)
    east = [name.endswith(("_2", "_3")) for name in terrain.scene.names]
    eyes = np.array([[20.0, 41.0, 2.0], [20.0, 41.0, 90.0], [20.0, 41.0, -1.0]])
    low, high, below = ~np.isnan(terrain_seen_from(terrain, eyes))
    assert not low[east].any()
    assert low[~np.array(east)].sum() >= 4
    assert high.all()
    assert not below.any()


def test_eyes_beyond_the_terrain_and_over_holes_see_it():
    heights = np.ones((5, 5))
    heights[2, 2] = np.nan
    terrain = terrain_of(heights, (10.0, 10.0), 2)
    eyes = np.array([[-30.0, 20.0, 5.0], [20.0, 20.5, 0.5], [20.0, 300.0, 0.5]])
    outside, hole, under = ~np.isnan(terrain_seen_from(terrain, eyes))
    assert outside.all()
    # From within the hole one sees its sides: the squares around it.
    assert hole.all()
    assert under.sum() == 2
