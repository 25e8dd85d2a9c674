"""What sticks out in a picture is drawn in; the rest stays as it is."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.coverage import coverage_masks
from simplifier.refinement.withdraw import withdraw
from tests.solids import sphere

SIZE = 128
BALL = sphere(1.0, rings=16)
VIEW = hemisphere_directions(1)
NONE = np.empty((0, 3, 3))


def pictures(count):
    """(count, 2, 4) of the ball of radius 1 about the origin, with a third of it around."""
    axes = image_axes(hemisphere_directions(count))[:, :2]
    middle = np.full((count, 2, 1), SIZE / 2)
    return np.ascontiguousarray(np.concatenate([axes * SIZE / 2.7, middle], axis=2))


def beside(soup, views):
    """(V,) pixels that a soup covers and the ball does not."""
    corners = np.arange(3 * len(soup), dtype=np.int32).reshape(-1, 3)
    shown = coverage_masks(soup.reshape(-1, 3), corners, views, SIZE, SIZE)
    ball = coverage_masks(BALL.vertices, BALL.faces, views, SIZE, SIZE)
    return np.bitwise_count(shown & ~ball).sum(axis=(1, 2))


def within(inner, outer):
    """Whether a triangle lies in another of the same plane, but for rounding."""
    edges = np.stack([outer[1] - outer[0], outer[2] - outer[0]], axis=1)
    weights, *_ = np.linalg.lstsq(edges, (inner - outer[0]).T, rcond=None)
    placed = (edges @ weights).T + outer[0]
    return (
        np.allclose(placed, inner, atol=1e-9)
        and weights.min() > -1e-9
        and weights.sum(axis=0).max() < 1.0 + 1e-9
    )


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.integers(1, 9))
def test_nothing_sticks_out_in_any_picture(seed, count, views):
    random = np.random.default_rng(seed)
    soup = random.normal(0.0, 0.5, (count, 3, 3))
    lines = pictures(views)
    left = withdraw(soup, BALL.vertices, BALL.faces, lines, SIZE, views)
    assert (beside(left, lines) == 0).all()
    assert all(any(within(one, other) for other in soup) for one in left)
    # What is in already stays as it is, to the bit.
    again = withdraw(left, BALL.vertices, BALL.faces, lines, SIZE, views)
    np.testing.assert_array_equal(again, left)


def test_only_the_corner_that_sticks_out_moves_much():
    spike = np.array([[[0.0, -0.3, 0.0], [0.0, 0.3, 0.0], [1.8, 0.0, 0.0]]])
    quiet = np.array([[[0.1, 0.2, 0.3], [-0.2, 0.4, 0.1], [0.3, -0.4, -0.2]]])
    views = pictures(64)
    left = withdraw(np.concatenate([quiet, spike]), BALL.vertices, BALL.faces, views, SIZE, 64)
    np.testing.assert_array_equal(left[0], quiet[0])
    np.testing.assert_array_equal(left[1, :2], spike[0, :2])
    assert 0.7 < left[1, 2, 0] < 1.05


def test_what_lies_beside_it_all_is_given_up():
    far = np.array([[[1.1, 0.0, 0.0], [1.2, 0.0, 0.0], [1.1, 0.1, 0.0]]])
    assert withdraw(far, BALL.vertices, BALL.faces, pictures(16), SIZE, 16).shape == (0, 3, 3)
    assert withdraw(NONE, BALL.vertices, BALL.faces, pictures(16), SIZE, 16).shape == (0, 3, 3)


def test_it_ends_after_enough_clean_pictures():
    """And begins to count anew after one that is not."""
    views = np.repeat(pictures(1), 1024, axis=0)
    away = pictures(3)[2]
    soup = np.array([[[0.0, 0.0, 0.0], [0.0, 0.5, 0.0], 1.8 * image_axes(VIEW)[0, 2]]])
    for place, found in ((0, True), (200, True), (1000, False)):
        some = views.copy()
        some[place] = away
        left = withdraw(soup, BALL.vertices, BALL.faces, some, SIZE, 256)
        assert (beside(left, away[None])[0] == 0) == found
