"""Depths of the original, and a search that pays for what stands before them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.geometry.room import Room
from simplifier.kernels.annealing import TRIES
from simplifier.kernels.soup_views import FRONT_STEP, UNIT
from simplifier.refinement.annealing import Annealing, Prices
from simplifier.refinement.depths import NO_DEPTHS, Depths
from tests.refinement.soups import SIZE, ball, crossed_quads, score, views_of
from tests.solids import sphere

VIEWS = views_of(ball())
RADIUS, TOLERANCE = 6.0, 0.5  # of the sphere that stands for the original


def depths(turned=True):
    mesh = sphere()
    points = np.array(mesh.vertices)
    points = SIZE / 2 + RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True)
    return Depths.of(points, mesh.faces, VIEWS.projections, 64, TOLERANCE, turned)


def test_limits_lie_before_the_surface_on_the_side_of_the_viewer():
    """Of a ball: a radius before its centre, and every other view sees the far side."""
    found = depths()
    straight = depths(turned=False)
    assert np.array_equal(found.away[1::2], straight.away[1::2])
    assert np.array_equal(found.away[::2], -straight.away[::2])
    for away, limits in zip(found.away, found.limits, strict=True):
        centre = np.full(3, SIZE / 2) @ away[:3]
        assert np.isinf(limits[0]).all()
        nearest = limits[np.isfinite(limits)].min()
        assert nearest == pytest.approx(centre - RADIUS - TOLERANCE, abs=0.1 * RADIUS)


def test_a_search_looks_at_some_rows_only():
    some = depths().rows_of_search()
    assert np.array_equal(some.limits, depths().limits[:, FRONT_STEP // 2 :: FRONT_STEP])
    assert some.known
    assert not NO_DEPTHS.known


def test_the_score_that_moves_keep_up_is_that_of_pictures_drawn_afresh():
    views = replace(VIEWS, depths=depths().rows_of_search())
    search = Annealing(crossed_quads(), Room.of(ball()), views, Prices(UNIT, 20, 90), 3)
    for step in range(4):
        search.run(50 * TRIES, (0.2 * step, 0.2 * step + 0.2))
        assert search.score == score(search.best(), views, 1.0, 20, 90)
    assert search._scores.sum() == score(search.current(), views, 1.0, 20, 90)


def test_a_toll_keeps_triangles_behind_the_surface():
    """The ball that may be used is larger than the sphere that is seen."""
    views = replace(VIEWS, depths=depths().rows_of_search())
    shares = []
    for toll in (0, 4000):
        search = Annealing(crossed_quads(), Room.of(ball()), views, Prices(UNIT, 0, toll), 1)
        search.run(400 * TRIES, (0.0, 1.0))
        shares.append(search.front().mean())
    assert shares[1] < 0.5 * shares[0]


def test_unpriced_depths_change_nothing():
    """A toll of 0 is no toll: the same moves are taken."""
    found = []
    for views in (VIEWS, replace(VIEWS, depths=depths().rows_of_search())):
        search = Annealing(crossed_quads(), Room.of(ball()), views, Prices(UNIT, 20), 5)
        search.run(200 * TRIES, (0.0, 0.6))
        found.append(search.current())
    assert np.array_equal(*found)
