"""Cull maps towards some objects alone: as plain rays, and as lines past the solid itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from simplifier.kernels.close_look import look_for, look_from_cells
from simplifier.visibility.cull_maps.erosion import Window, shrunk
from tests.kernels.test_cull_map import PLACES, Raster, followed, long_way

SEEDS = st.integers(0, 2**32 - 1)


def scratch_of(raster):
    slopes, asked, tiles = raster.scratch
    return slopes, asked, np.empty(max(len(tiles), raster.count), np.int32)


def objects_of(raster):
    """The boxes of objects, one a pixel, by low and high x, low and high y; and their tops."""
    x, y = np.nonzero(raster.numbers >= 0)
    return np.stack([x, x + 1.0, y, y + 1.0], axis=1), raster.object_codes


def looked_for(raster, sample, wanted, free=()):
    """(n,) the objects among those wanted that the sample sees, and the work."""
    seen = np.zeros(raster.count, np.bool_)
    work = look_for(
        sample, raster.solid, np.array(free, dtype=np.int64).reshape(-1, 4), raster.pixels,
        *objects_of(raster), scratch_of(raster), wanted, seen,
    )  # fmt: skip
    return seen & wanted, work


@settings(max_examples=12, deadline=None)
@given(SEEDS)
def test_it_sees_what_plain_rays_see_of_what_is_wanted(seed):
    random = np.random.default_rng(seed)
    shape = tuple(random.integers(3, 24, 2))
    tops = np.where(random.random(shape) < 0.5, random.uniform(0.0, 9.0, shape), -np.inf)
    tops[0, 0] = 1.0
    inner = np.where(random.random(shape) < 0.6, tops - random.uniform(0.0, 1.0, shape), -np.inf)
    raster = Raster(inner, tops)
    free = [(3, 6, 2, 5)] if seed % 2 else []
    sample = raster.sample(*(random.uniform(-0.1, 1.1, 2) * shape), random.uniform(-2.0, 12.0))
    wanted = random.random(raster.count) < random.random()
    found, (steps, _) = looked_for(raster, sample, wanted, free)
    there = followed(raster, sample, free)
    assert set(np.flatnonzero(found).tolist()) == there & set(np.flatnonzero(wanted).tolist())
    whole, (most, _) = raster.see(sample, free)
    assert not (found & ~whole).any()
    assert steps <= most


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize(("tower", "seen"), [(50.0, False), (58.0, True)])
def test_far_away_a_tower_is_seen_if_it_is_higher_than_the_shadow(turns, tower, seen):
    raster = long_way(tower, turns)
    wanted = np.zeros(raster.count, np.bool_)
    wanted[raster.numbers[raster.tops == tower]] = True
    found, (steps, tests) = looked_for(raster, raster.sample(*PLACES[turns], 2.0), wanted)
    assert found[wanted].tolist() == [seen]
    assert tests > 0
    _, (most, _) = raster.see(raster.sample(*PLACES[turns], 2.0))
    assert 0 < steps < 0.2 * most


def test_from_above_a_ray_goes_on_though_its_shadow_is_above_all_that_is_wanted():
    tops = np.full((32, 8), -np.inf)
    tops[8], tops[20, 4] = 10.0, -1.0
    raster = Raster(np.where(tops > 0.0, tops, -np.inf), tops)
    wanted = raster.object_codes == raster.object_codes[raster.numbers[20, 4]]
    found, _ = looked_for(raster, raster.sample(4.5, 4.5, 15.0), wanted)
    assert 15.0 - 1.25 * 5 > -1.0 > 15.0 - 1.25 * 16
    assert found[wanted].tolist() == [True]


def test_what_is_not_wanted_takes_no_steps():
    raster = long_way(58.0, 0)
    none = np.zeros(raster.count, np.bool_)
    assert looked_for(raster, raster.sample(20.5, 4.5, 2.0), none)[1] == (0, 0)


def test_each_cell_has_its_own_wanted_objects():
    raster = long_way(58.0, 0, reach=4)
    samples = np.array([raster.sample(20.5, 2.5, 2.0)] * 2)
    tower = raster.numbers[560, 2]
    seen, work = np.zeros((2, raster.count), np.bool_), np.zeros((2, 2), np.int64)
    wanted = np.zeros((2, raster.count), np.bool_)
    wanted[1, tower] = True
    look_from_cells(
        0, 2, samples, np.array([0, 1, 2]), raster.solid, np.empty((0, 4), np.int64),
        np.array([0, 0, 0]), raster.pixels, *objects_of(raster), scratch_of(raster), wanted,
        seen, work,
    )  # fmt: skip
    assert (seen & wanted)[:, tower].tolist() == [False, True]
    assert (work[:, 0] > 0).tolist() == [False, True]


def random_heights(random, shape):
    """Heights that hide, and those of objects, one a pixel."""
    solid = random.random(shape) < 0.4 * random.random()
    wide = solid | np.roll(solid, 1, axis=0) | np.roll(solid, 1, axis=1) | np.roll(solid, 2, axis=1)
    inner = np.where(wide, random.uniform(0.5, 20.0, shape), -np.inf)
    some = wide | (random.random(shape) < 0.1)
    some[-1, -1] = True
    tops = np.maximum(np.where(some, random.uniform(0.5, 9.0, shape), -np.inf), inner)
    return inner.astype(np.float32), tops.astype(np.float32)


def clear(inner, eye, point):
    """Whether a line passes over all solid pixels, by where it enters and leaves each."""
    ways = [0.0, 1.0]
    for axis in (0, 1):
        if eye[axis] != point[axis]:
            low, high = sorted([eye[axis], point[axis]])
            borders = np.arange(np.ceil(low), np.floor(high) + 1)
            ways += ((borders - eye[axis]) / (point[axis] - eye[axis])).tolist()
    ways = np.sort(ways)
    middles = 0.5 * (ways[1:] + ways[:-1])
    x, y = np.floor(eye[:2] + middles[:, None] * (point[:2] - eye[:2])).astype(int).T
    heights = eye[2] + ways * (point[2] - eye[2])
    return bool((np.minimum(heights[1:], heights[:-1]) >= inner[x, y]).all())


@settings(max_examples=25, deadline=None)
@given(SEEDS, st.sampled_from([(40, 40), (700, 9), (9, 1300)]), st.booleans())
@example(7, (700, 9), True)
def test_what_a_line_from_the_piece_of_edge_reaches_is_seen(seed, shape, closely):
    random = np.random.default_rng(seed)
    inner, tops = random_heights(random, shape)
    half = random.uniform(0.1, 3.0)
    axis = int(random.integers(2))
    # Where the sample stands nothing hides, as nothing does within a cell.
    middle = np.minimum(random.random(2) * [60.0, 60.0], np.array(shape) - 0.01)
    reach = np.array([half, 0.0]) if axis == 0 else np.array([0.0, half])
    ends = np.floor([middle - reach, middle + reach]).astype(int)
    (x0, y0), (x1, y1) = np.maximum(ends, 0)
    inner[x0 : x1 + 1, y0 : y1 + 1] = -np.inf
    height = random.uniform(0.0, 6.0)
    pixels = int(np.ceil(half))
    window = Window.box(pixels, 1) if axis == 0 else Window.box(1, pixels)
    raster = Raster(shrunk(inner, window), tops)
    sample = raster.sample(*middle, height, *reach)
    found, _ = raster.see(sample)
    if closely:
        found, _ = looked_for(raster, sample, np.ones(raster.count, np.bool_))
    places = np.argwhere(np.isfinite(tops))
    for index in np.flatnonzero(~found)[:150]:
        corner = places[index]
        for _ in range(12):
            eye = np.array([*(middle + random.uniform(-1.0, 1.0) * reach), height])
            eye[:2] = np.clip(eye[:2], 0.0, np.array(shape) - 1e-9)
            point = np.array([*(corner + random.random(2)), tops[tuple(corner)]])
            assert not clear(inner, eye, point)
