"""Altitudes from which tiles are seen: no exact line sees one from below, and ridges hide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.visibility.checking.terrain_view import terrain_seen_from
from simplifier.visibility.columns import horizons as module
from simplifier.visibility.columns import sweep_posts
from simplifier.visibility.columns.horizons import AltitudeScale, horizons, tile_altitudes
from simplifier.visibility.columns.sweep_posts import Axis, SweepPosts
from tests.visibility.solid.test_terrain import HEIGHTS, terrain_of


def altitudes_of(terrain, size=1, high=None):
    """(k, l, n) float64 the altitudes that numbers stand for."""
    low = float(terrain.heights[terrain.posts].min())
    high = float(terrain.heights.max()) + 20.0 if high is None else high
    scale = AltitudeScale.of(low, high)
    return scale.altitudes(horizons(SweepPosts.of(terrain, size), terrain, scale, high))


def mirrored(heights):
    """Seen in a mirror each square is split along its other diagonal."""
    return np.ascontiguousarray(np.asarray(heights)[:, ::-1])


def leaks(terrain, altitudes, random, count=40, azimuths=90):
    """Tiles that exact lines see from points of columns just below their altitude."""
    spacing = np.array(terrain.elevation.spacing)
    extent = spacing * (np.array(terrain.heights.shape) - 1)
    found = []
    for _ in range(count):
        place = random.uniform(0.0, 1.0, 2) * extent
        posts = (place / spacing).astype(int)
        column = posts[0] // terrain.tile
        row = (terrain.heights.shape[1] - 2 - min(posts[1], terrain.heights.shape[1] - 2)) // (
            terrain.tile
        )
        above = altitudes[column, row]
        wanted = np.flatnonzero(np.isfinite(above))
        if len(wanted) == 0:
            continue
        tile = random.choice(wanted)
        eye = np.array([*(place + terrain.corner), above[tile] - 1e-6])
        seen = ~np.isnan(terrain_seen_from(terrain, eye[None], azimuths)[0])
        found += np.flatnonzero(seen & (above > eye[2])).tolist()
    return found


@settings(max_examples=25)
@given(HEIGHTS, st.integers(1, 4), st.sampled_from([1, 2]), st.integers(0, 99))
def test_nothing_is_seen_from_below_its_altitude_split_either_way(heights, tile, size, seed):
    random = np.random.default_rng(seed)
    for each in (heights, mirrored(heights)):
        terrain = terrain_of(each, (1.0, 1.5), tile)
        altitudes = altitudes_of(terrain, min(size, max(tile // 2, 1)))
        assert leaks(terrain, altitudes, random, 8, 60) == []


def rough(seed, size=25):
    """Steps of two heights, three posts wide, with slits between them."""
    random = np.random.default_rng(seed)
    blocks = random.random((size // 4 + 1, size // 4 + 1)) < 0.5
    heights = np.kron(blocks, np.ones((4, 4)))[:size, :size] * 12.0
    heights[::7] = heights[:, ::9] = 0.0
    return heights + random.uniform(0.0, 1.0, heights.shape)


@pytest.mark.parametrize("tile", [4, 5])
def test_nothing_leaks_among_steps_and_slits(tile):
    random = np.random.default_rng(0)
    hidden = 0
    for seed in range(3):
        for heights in (rough(seed), mirrored(rough(seed))):
            terrain = terrain_of(heights, (3.0, 2.0), tile)
            altitudes = altitudes_of(terrain)
            hidden += np.isfinite(altitudes).mean() / 6
            assert leaks(terrain, altitudes, random) == []
    assert hidden > 0.1


def not_eroded(heights, posts, size, eroded_posts=sweep_posts.eroded_posts):
    return np.pad(heights, size + 2)


def fewer_stands(ends, size, of=Axis.of):
    axis = of(ends, size)
    lines = axis.lines.copy()
    lines[[posts[0] for posts in axis.stands]] = -1
    return replace(axis, lines=lines)


def lowest_targets(posts, column, row, targets=SweepPosts.targets):
    places, _ = targets(posts, column, row)
    return places, posts.heights[places[:, 0], places[:, 1]]


@pytest.mark.parametrize(
    ("owner", "name", "fault"),
    [
        (sweep_posts, "eroded_posts", not_eroded),
        (Axis, "of", staticmethod(fewer_stands)),
        (SweepPosts, "targets", lowest_targets),
    ],
)
def test_faults_leak(monkeypatch, owner, name, fault):
    monkeypatch.setattr(owner, name, fault)
    random, found = np.random.default_rng(0), []
    for seed in range(3):
        terrain = terrain_of(rough(seed), (3.0, 2.0), 4)
        found += leaks(terrain, altitudes_of(terrain), random, 100)
    assert found


def test_the_altitude_over_a_wall_is_that_of_the_line_over_its_top():
    heights = np.zeros((9, 33))
    heights[:, 11:14] = 10.0
    terrain = terrain_of(heights, (7.0, 5.0), 8)
    high = 200.0
    lowest = tile_altitudes(SweepPosts.of(terrain, 1), 0, 0, high)
    assert lowest[0, 0] == -np.inf
    # From line 1 over line 12, all that erosion leaves of the wall; lines 17 and 25 are the first
    # that stand for their columns.  Lengths along x cancel.
    assert lowest[2, 0] == pytest.approx(10.0 * (17 - 1) / (12 - 1))
    assert lowest[3, 0] == pytest.approx(10.0 * (25 - 1) / (12 - 1))


def test_a_ridge_of_one_post_hides_nothing_where_it_may_be_looked_past():
    heights = np.zeros((17, 33))
    heights[:, 12] = 10.0
    assert altitudes_of(terrain_of(heights, tile=8)).max() <= 0.1
    heights[:, 11:14] = 10.0
    assert altitudes_of(terrain_of(heights, tile=8)).max() > 20.0


def test_a_hole_hides_nothing_and_its_tile_is_always_visible():
    heights = np.zeros((25, 33))
    heights[:, 11:14] = 10.0
    whole = terrain_of(heights, tile=8)
    closed = altitudes_of(whole)
    heights[12, 12] = np.nan
    terrain = terrain_of(heights, tile=8)
    open_ = altitudes_of(terrain)
    (holed,) = np.flatnonzero(terrain.holed)
    assert (open_[:, :, holed] == -np.inf).all()
    west, east = (terrain.scene.names.index(name) for name in ("tile_1_0", "tile_1_3"))
    assert (closed[3, 1, west], closed[0, 1, east]) > (10.0, 10.0)
    assert open_[3, 1, west] < 0.1
    assert open_[0, 1, east] < 0.1
    assert (open_ <= closed + 1e-2).all()
    lonely = np.full((9, 9), np.nan)
    lonely[:3, :3] = 0.0
    assert altitudes_of(terrain_of(lonely)).shape == (4, 4, 1)


def test_a_piece_of_jacksboro_beside_exhaustive_sampling(asset):
    """Lines from every second post of the columns, all around."""
    heights = np.load(asset("dem_jacksboro_344x403_int16.npy"))[96:145, 240:289]
    terrain = terrain_of(heights, (74.40, 92.67), 8)
    altitudes = altitudes_of(terrain)
    hidden = sampled = 0
    x0, y0 = (axis.ravel() for axis in np.meshgrid(np.arange(0, 9, 2), np.arange(0, 9, 2)))
    for i, j in np.ndindex(6, 6):
        x, y = x0 + 8 * i, y0 + 8 * (5 - j)
        top = terrain.heights[x.min() : x.max() + 1, y.min() : y.max() + 1].max() + 2.0
        eyes = np.stack([x * 74.40, y * 92.67, np.full(x.shape, top)], axis=1)
        eyes = np.clip(eyes, 1e-3, [48 * 74.40 - 1e-3, 48 * 92.67 - 1e-3, top])
        seen = ~np.isnan(terrain_seen_from(terrain, eyes, 360)).all(axis=0)
        found = altitudes[i, j] > top
        assert not (found & seen).any()
        hidden, sampled = hidden + found.sum(), sampled + (~seen).sum()
    assert hidden >= 0.6 * sampled > 0


def test_any_number_of_threads_finds_the_same(monkeypatch):
    terrain = terrain_of(rough(1), tile=4)
    found = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        found.append(altitudes_of(terrain))
    assert np.array_equal(*found)


@given(
    st.floats(-1e6, 1e6),
    st.floats(1e-3, 1e5),
    st.lists(st.floats(-0.1, 1.0), min_size=1, max_size=9),
)
def test_numbers_stand_for_altitudes_no_higher_and_close(low, extent, shares):
    high = low + extent
    scale = AltitudeScale.of(low, high)
    exact = np.array(shares) * extent + low
    held = scale.altitudes(scale.counted(exact))
    assert (held <= exact).all()
    assert scale.low <= low
    counted = exact >= low + 0.01 * extent
    near = 3.0 * scale.step + 1e-8 * max(abs(low), abs(high))
    assert (held[counted] >= exact[counted] - near).all()
    assert scale.counted(np.array([-np.inf, -1e36])).tolist() == [0, 0]
    assert (np.float32(scale.low), np.float32(scale.step)) == (scale.low, scale.step)


def test_told_shares_may_end_it():
    def tell(share):
        raise KeyboardInterrupt

    terrain = terrain_of(rough(0), tile=4)
    scale = AltitudeScale.of(0.0, 20.0)
    with pytest.raises(KeyboardInterrupt):
        module.horizons(SweepPosts.of(terrain, 1), terrain, scale, 20.0, tell)
