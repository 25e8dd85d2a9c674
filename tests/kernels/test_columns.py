"""Heights over columns against triangles cut by shapely."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from simplifier.kernels.columns import block_columns, raise_columns

SHAPE = (7, 5)


def heights(points, faces):
    lows, highs = np.full(SHAPE, np.inf), np.full(SHAPE, -np.inf)
    raise_columns(np.ascontiguousarray(points), faces, lows, highs)
    return lows, highs


def plain_heights(points, faces):
    """Of the corners of what each column leaves of each triangle."""
    lows, highs = np.full(SHAPE, np.inf), np.full(SHAPE, -np.inf)
    for corners in points[faces]:
        plane = np.linalg.solve(np.column_stack([corners[:, :2], np.ones(3)]), corners[:, 2])
        for x, y in np.ndindex(SHAPE):
            piece = Polygon(corners[:, :2]).intersection(box(x, y, x + 1, y + 1))
            if piece.area > 0.0:
                ring = np.array(piece.exterior.coords)
                z = ring @ plane[:2] + plane[2]
                lows[x, y], highs[x, y] = min(lows[x, y], z.min()), max(highs[x, y], z.max())
    return lows, highs


@given(seed=st.integers(0, 10_000), count=st.integers(1, 4))
def test_heights_hold_the_pieces_and_little_more(seed, count):
    rng = np.random.default_rng(seed)
    points = rng.uniform((-3.0, -3.0, 0.0), (10.0, 8.0, 9.0), (3 * count, 3))
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    lows, highs = heights(points, faces)
    plain_lows, plain_highs = plain_heights(points, faces)
    met = np.isfinite(plain_lows)
    assert np.array_equal(met, np.isfinite(lows))
    assert (lows[met] <= plain_lows[met] + 1e-9).all()
    assert (highs[met] >= plain_highs[met] - 1e-9).all()
    assert (lows[met] >= points[:, 2].min()).all()
    assert (highs[met] <= points[:, 2].max()).all()


def test_a_slope_is_exact_where_it_covers_the_column():
    points = np.array([[-50.0, -50.0, 0.0], [150.0, -50.0, 20.0], [-50.0, 150.0, 0.0]])
    lows, highs = heights(points, np.array([[0, 1, 2]], dtype=np.int32))
    x = np.arange(SHAPE[0])[:, None]
    assert lows == pytest.approx(np.broadcast_to(5.0 + 0.1 * x, SHAPE))
    assert highs == pytest.approx(np.broadcast_to(5.1 + 0.1 * x, SHAPE))


@pytest.mark.parametrize("turn", [(0, 1, 2), (1, 0, 2)])
def test_a_wall_marks_the_columns_that_it_stands_on(turn):
    points = np.array([[1.5, 2.5, 1.0], [4.5, 2.5, 1.0], [4.5, 2.5, 8.0]])[:, turn]
    lows, highs = heights(points, np.array([[0, 1, 2]], dtype=np.int32))
    expected = np.zeros(SHAPE, dtype=bool)
    for along in range(1, 5):
        expected[(along, 2) if turn[0] == 0 else (2, along)] = True
    assert np.array_equal(np.isfinite(lows), expected)
    assert (lows[expected] == 1.0).all()
    assert (highs[expected] == 8.0).all()


def test_a_face_between_two_columns_touches_both():
    points = np.array([[3.0, 1.2, 0.0], [3.0, 1.8, 0.0], [3.0, 1.5, 4.0]])
    lows, _ = heights(points, np.array([[0, 1, 2]], dtype=np.int32))
    assert np.argwhere(np.isfinite(lows)).tolist() == [[2, 1], [3, 1]]


@given(seed=st.integers(0, 10_000))
def test_blocked_is_where_heights_meet_the_band(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform((-3.0, -3.0, 0.0), (10.0, 8.0, 9.0), (3, 3))
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    low = rng.uniform(0.0, 9.0, SHAPE)
    high = low + rng.uniform(0.0, 2.0, SHAPE)
    blocked = np.zeros(SHAPE, dtype=np.bool_)
    block_columns(points, faces, low, high, blocked)
    lows, highs = heights(points, faces)
    assert np.array_equal(blocked, (lows <= high) & (highs >= low))


def test_what_is_outside_is_left_out():
    points = np.array([[-9.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 4.0, 0.0]])
    assert not np.isfinite(heights(points, np.array([[0, 1, 2]], dtype=np.int32))[0]).any()
