"""What sweeps look at: a bound of the surface around posts, and posts that stand for columns."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.visibility.columns.sweep_posts import Axis, SweepPosts, eroded_posts
from tests.visibility.solid.test_terrain import HEIGHTS, surface, terrain_of


@settings(max_examples=25)
@given(HEIGHTS, st.sampled_from([1, 2]), st.booleans(), st.randoms(use_true_random=False))
def test_eroded_heights_are_below_all_surfaces_around_any_point_of_a_line(
    heights, size, holed, random
):
    if holed and min(heights.shape) > 4:
        heights = heights.copy()
        heights[random.randrange(heights.shape[0]), random.randrange(heights.shape[1])] = np.nan
    terrain = terrain_of(heights)
    pad = size + 2
    eroded = eroded_posts(terrain.heights, terrain.posts, size)
    nx, ny = terrain.heights.shape
    assert eroded.shape == (nx + 2 * pad, ny + 2 * pad)
    assert np.isfinite(eroded).all()
    steps = np.linspace(-size, size, 8 * size + 1)
    for line in range(nx):
        for place in np.linspace(-size, ny - 1 + size, 5):
            place += 0.3 * random.random() if place < 0 else -0.3 * random.random()
            bound = np.interp(place, np.arange(-pad, ny + pad), eroded[line + pad])
            x, y = (axis.ravel() for axis in np.meshgrid(line + steps, place + steps))
            within = (x >= 0) & (x <= nx - 1) & (y >= 0) & (y <= ny - 1)
            x, y = x[within], y[within]
            known = terrain.known[
                np.minimum(x.astype(int), nx - 2), np.minimum(y.astype(int), ny - 2)
            ]
            if not known.all():
                assert bound < -1e30
            for split in (0, 1):
                assert (
                    bound <= surface(terrain, x[known], y[known], split).min(initial=np.inf) + 1e-9
                )


def test_holes_have_no_bound_and_what_is_beyond_the_border_costs_none():
    heights = np.full((9, 11), 5.0)
    heights[4, 3] = np.nan
    terrain = terrain_of(heights)
    eroded = eroded_posts(terrain.heights, terrain.posts, 1)[3:-3, 3:-3]
    assert (eroded == 5.0)[6:].all()
    assert (eroded[:2] == np.where(eroded[:2] < 0.0, eroded[:2], 5.0)).all()
    assert (eroded[2:5, 3:6] < -1e30).all()
    assert eroded[0].tolist() == [5.0] * 9


@given(st.integers(1, 40), st.integers(1, 9), st.integers(1, 4))
def test_each_point_of_a_column_has_a_post_nearby_that_stands_for_it(count, tile, size):
    ends = np.append(np.arange(0, count, tile), count)
    axis = Axis.of(ends, size)
    for column, (begin, end) in enumerate(pairwise(ends)):
        posts = axis.stands[column]
        assert ((posts >= begin) & (posts < end)).all()
        assert (axis.lines[posts] == column).all()
        for point in np.linspace(begin, end, 4 * (end - begin) + 1):
            assert np.abs(posts - point).min() <= size
    assert sum(map(len, axis.stands)) == (axis.lines >= 0).sum()


def test_columns_are_counted_from_the_north_and_their_highest_points_hold_the_tile():
    random = np.random.default_rng(0)
    heights = random.uniform(0.0, 9.0, (8, 6))
    terrain = terrain_of(heights, tile=4)
    posts = SweepPosts.of(terrain, 1, 100.0)
    assert posts.x.ends.tolist() == [0, 4, 5]
    assert posts.y.ends.tolist() == [0, 3, 7]
    places, tops = posts.targets(0, 1)
    assert places.tolist() == [[1, 4], [1, 6], [3, 4], [3, 6]]
    # Rows 3 to 7 from the south are rows 4 to 0 from the north.
    assert tops.max() == pytest.approx(heights[:5, :5].max() - 100.0)
    assert tops[0] == pytest.approx(heights[2:5, :3].max() - 100.0)
