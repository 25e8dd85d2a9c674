"""Voxel columns as published leak between their samples; those by sweeps do not."""

from __future__ import annotations

import numpy as np

from bench.visibility_terrain import Forms, terrain_rows
from bench.voxel_columns import line_of_sight, published_sets
from simplifier.visibility.columns.horizons import tile_altitudes
from simplifier.visibility.columns.sweep_posts import SweepPosts
from tests.visibility.columns.test_horizons import rough
from tests.visibility.solid.test_terrain import terrain_of


def plain_line(heights, begin, end):
    """Whether a line, rounded to posts and whole heights at each step, is below none of them."""
    begin, end = np.array(begin), np.array(end)
    steps = int(np.abs(end - begin)[:2].max())
    for step in range(steps + 1):
        # Halves are rounded away from where the line comes from, as the error terms do.
        way = (end - begin) * step
        half = steps // 2
        x, y, z = begin + np.sign(way) * ((np.abs(way) + half) // max(steps, 1))
        if z < heights[x, y]:
            return False
    return True


def test_a_line_is_one_of_rounded_posts():
    random = np.random.default_rng(0)
    heights = random.integers(0, 12, (9, 11))
    free = 0
    for _ in range(400):
        begin, end = (tuple(random.integers(0, [9, 11, 30]).tolist()) for _ in range(2))
        known = plain_line(heights, begin, end)
        assert line_of_sight(heights, *begin, *end) == known
        free += known
    assert 40 < free < 360


def test_the_horizon_is_the_first_voxel_from_above_that_sees_nothing():
    heights = np.zeros((9, 33))
    heights[:, 14:17] = 10.0
    posts = SweepPosts.of(terrain_of(heights, tile=8), 1)
    tops = np.tile(np.array([40, 12, 11, 1]), (4, 1))
    found = published_sets(posts, tops, np.arange(4))
    assert found[0, 1].all()
    assert found[0, 3].tolist() == [True, False, False, False]
    coarse = published_sets(posts, tops, np.arange(4), last=8)
    assert (coarse <= found).all()


def test_a_ridge_between_samples_is_seen_by_sweeps_alone():
    heights = np.zeros((9, 33))
    heights[:, 14:17] = 10.0
    heights[:, 27] = 40.0  # behind the wall, and on no fourth post
    terrain = terrain_of(heights, tile=8)
    posts = SweepPosts.of(terrain, 1)
    tops = np.full((4, 1), 2)
    assert not published_sets(posts, tops, np.arange(1), last=4)[0, 3, 0]
    assert published_sets(posts, tops, np.arange(1), last=1)[0, 3, 0]
    assert tile_altitudes(posts, 3, 0, 100.0)[0, 0] < 2.0


def test_gaps_between_samples_leak_as_published_and_not_by_sweeps(tmp_path):
    path = tmp_path / "slits.npy"
    np.save(path, np.rint(4.0 * rough(1, 33)))
    forms = Forms(sizes=(1,), steps=(1, 2), epsilons=())
    sweeps, fine, coarse = terrain_rows(path, 4, 0.5, 30, 180, forms)
    assert sweeps["leaks"] == 0
    assert 0 < fine["leaks"] < coarse["leaks"]
    assert sweeps["hidden"] < fine["hidden"] < coarse["hidden"]
