"""Planes and half planes of polygons, by themselves, against exact or plain arithmetic."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from simplifier.kernels.depth_buffer import (
    PUSH,
    STALE,
    THINNEST,
    TILE,
    _draw_polygon,
    _draw_triangle,
    _polygon_plane,
    _set_plane,
    _span,
    _without_short_edges,
    fill_span,
    plane_through,
)
from simplifier.kernels.perspective import COLUMNS, CORNERS, FOCAL, ROWS


def polygon_of(corners):
    """In an array as long as the longest; what is past its corners would be mistaken for one."""
    polygon = np.tile([-7000.0, 9000.0, 1e-3], (CORNERS, 1))
    polygon[: len(corners)] = corners
    return polygon


def three_groups(rng, count, first, turn):
    """(count, 2) corners of a convex polygon, in order: one, some at a place, the rest at another.

    Only the triangle of corner 0, the last before ``first`` and ``first`` has an area to speak of.
    """
    angles = np.cumsum([rng.uniform(0.0, 6.28), *rng.uniform(0.2, 2.5, 2)])
    group = np.array([0] + [1] * (first - 1) + [2] * (count - first))
    places = angles[group] + 1e-6 * np.arange(count)
    offset = rng.uniform(-200.0, 200.0, 2)
    return offset + 30.0 * np.column_stack([np.cos(places), turn * np.sin(places)])


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("count", range(4, CORNERS + 1))
def test_a_clipped_polygons_plane_is_the_chord_of_what_is_pushed_away(count, turn):
    """Wherever among its corners the only triangle is that has a plane."""
    for first in range(2, count):
        for seed in range(4):
            rng = np.random.default_rng([seed, first, count])
            places = three_groups(rng, count, first, turn)
            error = rng.choice([0.0, 0.05, 0.7, 3.0])
            slope = rng.normal(size=2) * rng.choice([0.001, 0.004])
            check_chord(places, rng.choice([0.5, 2.0]), slope, error)


def check_chord(places, middle, slope, error):
    """Of a polygon with that reciprocal depth in its middle, and those slopes of it."""
    values = middle + (places - places.mean(axis=0)) @ slope
    polygon = polygon_of(np.column_stack([places, 1.0 / values]))
    slope_x, slope_y, start = _polygon_plane(polygon, len(places), error)
    found = start + (places - places[0]) @ [slope_x, slope_y]
    pushed = values / (1.0 + error * values)
    least, most = values.min(), values.max()
    below = np.interp(values, [least, most], [pushed.min(), pushed.max()]) - found
    assert (0.99 * PUSH * most <= below).all()  # once for it, and once for its corners
    assert (below <= 2.01 * PUSH * most).all()
    assert (found <= pushed - 0.99 * PUSH * most).all()


@pytest.mark.parametrize("upright", [False, True])
def test_a_clipped_polygons_plane_is_found_where_a_side_is_level_or_upright(upright):
    places = np.array([[0.0, 0.0], [10.0, 5.0], [10.0, 5.0], [-10.0, 5.0], [-10.0, 5.0]])
    places[[1, 4], 1] -= 1e-6
    places = places[:, ::-1] if upright else places
    check_chord(places, 1.0, np.array([0.01, -0.02]), 0.5)


@pytest.mark.parametrize("error", [0.0, 0.4, 2.5])
def test_a_triangles_plane_goes_through_its_pushed_corners_and_no_chord(error):
    polygon = polygon_of([[3.0, 1.0, 2.0], [9.0, 2.0, 0.7], [5.0, 8.0, 4.0]])
    assert _polygon_plane(polygon, 3, error) == plane_through(polygon, 0, 1, 2, error)


def test_the_push_pays_for_what_rounding_adds():
    """Values and slopes for which numbers of 32 bits go up nearly as far as they can."""
    for value, slope, end in (
        (1.0802832266079923, -0.042884970077029676, 25),
        (1.049827402730123, -0.08578984802544119, 13),
        (1.0645774011224165, -0.018220471967187086, 56),
    ):
        depth = np.zeros((3, 64), dtype=np.float32)
        fill_span(depth, 1, 0, end, value, slope)
        exact = [Fraction(value) + column * Fraction(slope) for column in range(end)]
        over = [Fraction(float(depth[1, column])) - exact[column] for column in range(end)]
        assert 0.6 * 2.0**-22 < max(over) / max(exact) <= PUSH


SIDES = (-2.0, -0.5, -0.25, 0.0, 0.25, 0.5, 2.0)
"""Powers of two, so that kernels divide without rounding and ties are ties."""

LEVEL = (-(2.0**-70), 2.0**-70)
"""So nearly level that a row is crossed further out than an integer counts."""


def test_a_span_holds_the_centres_that_are_in_all_half_planes():
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(600):
        count = int(rng.integers(1, 4))
        planes = np.zeros((8, 5))
        planes[:count, 0] = rng.choice(SIDES + LEVEL, count)
        planes[:count, 1] = rng.choice(SIDES, count)
        planes[:count, 2:4] = rng.integers(-16, 80, (count, 2)) / 4.0
        planes[:count, 4] = rng.choice([0.0, 0.25, 0.5, 1.5], count)
        planes[count:, 4] = 1.0  # nothing is in these
        row, columns = int(rng.integers(0, 16)), int(rng.choice([1, 9, 16]))
        inside = [
            column
            for column in range(columns)
            if all(
                Fraction(a) * Fraction(column - x) + Fraction(b * (row - y)) >= Fraction(inset)
                for a, b, x, y, inset in planes[:count].tolist()
            )
        ]
        first, end = _span(planes, count, row, float(columns))
        assert list(range(first, end)) == inside
        seen.add(len(inside))
    assert seen == set(range(17))


def test_a_half_plane_lies_on_its_side_of_an_edge_and_as_far_in_as_asked():
    points = np.array([[3.0, 5.0, 1.0], [7.0, 3.0, 1.0]])
    for ends, side, inset in (
        ((0, 1), 1.0, 0.5), ((0, 1), -1.0, 0.5), ((1, 0), 1.0, -0.5), ((1, 0), -1.0, 0.0),
    ):  # fmt: skip
        planes = np.zeros((3, 5))
        _set_plane(planes, 1, points, *ends, side, inset)
        a, b, x, y, needed = planes[1]
        along = points[ends[1], :2] - points[ends[0], :2]
        for away in (-4.0, -0.1, 0.1, 4.0):
            place = points[ends[0], :2] + 0.3 * along + away * np.array([-along[1], along[0]])
            assert (a * (place[0] - x) + b * (place[1] - y) > 0.0) == (side * away > 0.0)
        assert needed == inset * 6.0
        assert not planes[[0, 2]].any()


@pytest.mark.parametrize("far", [0.0, 300.0])
def test_a_corner_that_is_as_good_as_the_next_is_left_out(far):
    """The first of the two; the next of the last is the first."""
    corners = np.array([[0.0, 0.0, 1.0], [9.0, 1.0, 2.0], [8.0, 7.0, 3.0], [1.0, 6.0, 4.0]])
    corners[:, :2] += far
    near = np.array([0.4 * THINNEST, -0.9 * THINNEST, 0.0])
    for double in range(5):
        if double < 4:
            polygon = polygon_of(np.insert(corners, double + 1, corners[double] + near, axis=0))
            kept = np.where(np.arange(4)[:, None] == double, corners + near, corners)
            count = 5
        else:
            polygon, kept, count = polygon_of(corners), corners, 4
        polygon[count] = polygon[count - 1]  # of an earlier polygon
        polygon[-1] = polygon[0]
        assert _without_short_edges(polygon, count) == 4
        np.testing.assert_array_equal(polygon[:4], kept)
    across = polygon_of(np.insert(corners, 0, corners[-1] + near, axis=0))
    assert _without_short_edges(across, 5) == 4
    np.testing.assert_array_equal(across[:4], [corners[3] + near, *corners[:3]])
    for away in ([1.1 * THINNEST, 0.0, 0.0], [0.0, -1.1 * THINNEST, 0.0]):
        polygon = polygon_of(np.insert(corners, 2, corners[1] + away, axis=0))
        assert _without_short_edges(polygon, 5) == 5


def test_tiles_that_a_triangle_passes_between_the_centres_are_left_alone():
    """Of a screen that is narrower than one."""
    points = np.array([[1.4, 0.4, 2.0], [2.6, 15.4, 2.0], [2.601, 15.4, 2.0]])
    view = np.zeros(16)
    view[[FOCAL, COLUMNS, ROWS]] = 10.0, 5.0, 2.0 * TILE
    depth = np.zeros((2 * TILE, TILE), dtype=np.float32)
    tiles = np.zeros((3, 2, 1), dtype=np.float32)
    _draw_triangle(points, 0, 1, 2, 0.5, 3.0, view, depth, tiles)
    assert not depth.any()
    assert not tiles.any()
    points[2, 0] = 4.6  # one centre of the upper tile, and more of the lower one
    _draw_triangle(points, 0, 1, 2, 0.5, 3.0, view, depth, tiles)
    assert depth[TILE:].any()
    assert tiles.any()


@pytest.mark.parametrize("apex", [1.3, 4.3, 9.7])
def test_tiles_that_no_whole_pixel_of_a_triangle_is_in_are_left_alone(apex):
    """Its upper part is narrower than a pixel."""
    points = np.array([[apex, -2.0, 2.0], [apex - 0.8, 15.6, 2.0], [apex + 1.5, 15.6, 2.0]])
    view, planes = np.zeros(16), np.empty((CORNERS, 5))
    view[[FOCAL, COLUMNS, ROWS]] = 10.0, 2.0 * TILE, 2.0 * TILE
    depth = np.zeros((2 * TILE, 2 * TILE), dtype=np.float32)
    tiles = np.zeros((3, 2, 2), dtype=np.float32)
    _draw_polygon(points, 3, 0.5, planes, view, depth, tiles)
    met = (depth > 0.0).reshape(2, TILE, 2, TILE).any(axis=(1, 3))
    assert met[1].any()
    assert not met[0].any()
    assert ((tiles[STALE] == 1.0) == met).all()
