"""Planes and half planes, by themselves, against exact or plain arithmetic."""

from __future__ import annotations

from fractions import Fraction
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.kernels.depth_buffer import (
    CORNERS,
    MARGIN,
    ROUNDED,
    SLACK,
    STALE,
    TILE,
    _draw_polygon,
    fill_region,
    plane_of,
    set_edge,
)
from tests.rasters import looking_ahead

SLACK_OF = 1e-4


def float32(values):
    return np.asarray(values, dtype=np.float32)


def plane_through(points, error, spare=0.0, order=(0, 1, 2)):
    """(slopes and value, whether there is one) of all of some points, in float64."""
    planes = np.zeros((2, 6), dtype=np.float32)
    found = plane_of(
        float32(points), len(points), *order, np.float32(error), np.float32(spare),
        np.float32(SLACK_OF), planes, 0,
    )  # fmt: skip
    return planes[0].astype(np.float64), found


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.3]), st.sampled_from([0.0, 0.5]))
def test_a_plane_is_a_little_behind_the_pushed_corners(seed, error, spare):
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-50.0, 50.0, (3, 2)), rng.uniform(0.5, 9.0, 3)])
    points = float32(points).astype(np.float64)
    sides = points[[1, 2, 0], :2] - points[:, :2]
    area = abs(sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0])
    if area < 300.0:
        return
    plane, found = plane_through(points, error, spare)
    assert found
    values = 1.0 / (points[:, 2] + error)
    at = plane[2] + (points[:, :2] - plane[3:5]) @ plane[:2]
    paid = spare * np.abs(plane[:2]).sum()
    assert (at + paid < values).all()
    assert (at + paid > values - 1e-3 * values.max()).all()
    assert plane[5] < values.min() < plane[5] * (1.0 + 1e-5)


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0), (-0.6, 0.8), (0.6, -0.8)])
@pytest.mark.parametrize("length", [0.01, 1.0, 100.0])
def test_a_triangle_thinner_than_rounding_has_its_farthest_corner_all_over(order, along, length):
    along = np.array(along)
    normal = np.array([-along[1], along[0]])
    for share, thin in ((0.5, True), (2.0, False)):
        height = share * SLACK_OF
        places = np.array([[0.0, 0.0], length * along, 0.4 * length * along + height * normal])
        points = np.column_stack([places, [2.0, 3.0, 7.0]])
        plane, found = plane_through(points, 0.25, order=order)
        # By the longer side of its bounds, which is no less than 0.7 of its longest side.
        assert found != thin
        assert (plane[:2] == 0.0).all() == thin
        if thin:
            assert plane[2] == plane[5]
            assert 1.0 / 7.25 * (1.0 - 1e-5) < plane[5] < 1.0 / 7.25


def test_rows_of_a_tile_that_are_added_up_stay_within_what_is_paid():
    """Values and slopes for which numbers of 32 bits go up nearly as far as they can."""
    edges = np.zeros((CORNERS, 7), dtype=np.float32)  # all of the screen
    worst = 0.0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        planes = np.zeros((2, 6), dtype=np.float32)
        planes[0, :3] = *rng.uniform(-0.05, 0.05, 2), rng.uniform(1.0, 2.0)
        planes[0, 3:5] = rng.uniform(-3.0, 11.0, 2)
        depth = np.zeros((TILE, TILE), dtype=np.float32)
        tiles = np.zeros((3, 1, 1), dtype=np.float32)
        fill_region(edges, 3, planes, 1, np.float32(9.0), np.float32(0.0), 0, 0, 7, 7, depth, tiles)
        a, b, value, x, y = map(Fraction, planes[0, :5].tolist())
        for row, column in np.ndindex(TILE, TILE):
            exact = value + a * (column - x) + b * (row - y)
            worst = max(worst, Fraction(float(depth[row, column])) - exact)
    assert 0.05 * ROUNDED < worst < ROUNDED


def test_a_region_holds_the_centres_that_are_in_all_half_planes():
    """Of 1 to 8 of them, across tiles and held to a block."""
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(400):
        count = int(rng.choice([3, 3, 4, 6, 8]))
        edges = np.zeros((CORNERS, 7), dtype=np.float32)
        for k in range(count):  # in quarters, so that sums are exact and ties are ties
            ends = float32(rng.integers(-64, 160, 4) / 4.0)
            inset = np.float32(rng.choice([0.0, -0.5, 0.25]))
            set_edge(edges, k, *ends, np.float32(rng.choice([-1.0, 1.0])), inset)
        planes = float32([[0.0, 0.0, 0.5, 0.0, 0.0, 0.5]] * 2)
        left, right = np.sort(rng.integers(0, 24, 2))
        top, bottom = np.sort(rng.integers(0, 24, 2))
        depth, tiles = np.zeros((24, 24), np.float32), np.zeros((3, 3, 3), np.float32)
        fill_region(
            edges, count, planes, 1, np.float32(1.0), np.float32(2.0), left, top, right, bottom,
            depth, tiles,
        )  # fmt: skip
        rows, columns = np.indices((24, 24))
        a, b, c, x, y = edges[:count, :5].astype(np.float64).T[..., None, None]
        within = (a * (columns - x) + b * (rows - y) + c >= 0.0).all(axis=0)
        within &= (rows >= top) & (rows <= bottom) & (columns >= left) & (columns <= right)
        np.testing.assert_array_equal(depth > 0.0, within)
        met = within.reshape(3, TILE, 3, TILE).any(axis=(1, 3))
        assert (tiles[STALE] == 1.0)[met].all()
        seen.add(int(within.sum()))
    assert len(seen) > 25


def test_a_half_plane_lies_on_its_side_of_an_edge_and_as_far_in_as_asked():
    points = np.array([[3.0, 5.0], [7.0, 3.0]])
    for ends, side, inset in (
        ((0, 1), 1.0, 0.5), ((0, 1), -1.0, 0.5), ((1, 0), 1.0, -0.5), ((1, 0), -1.0, 0.0),
    ):  # fmt: skip
        edges = np.zeros((3, 7), dtype=np.float32)
        begin, end = points[list(ends)]
        set_edge(edges, 1, *float32([*begin, *end, side, inset]))
        a, b, c, x, y, grows, falls = edges[1].astype(np.float64)
        along = end - begin
        for away in (-4.0, -0.1, 0.1, 4.0):
            place = begin + 0.3 * along + away * np.array([-along[1], along[0]])
            assert (a * (place[0] - x) + b * (place[1] - y) > 0.0) == (side * away > 0.0)
        assert c == -inset * 6.0
        corners = [a * dx + b * dy for dx in (0, 7) for dy in (0, 7)]
        assert (grows, falls) == (max(corners), min(corners))
        assert not edges[[0, 2]].any()


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("count", range(3, CORNERS + 1))
def test_a_clipped_polygon_is_nowhere_nearer_than_what_is_pushed_away(count, turn):
    """Wherever among its corners the largest triangle is; and hardly farther without an error."""
    size = np.array([24, 24])
    lens = np.zeros(4)
    lens[0], lens[MARGIN], lens[SLACK] = 10.0, 0.0, SLACK_OF
    pixels = 0
    for seed in range(30):
        rng = np.random.default_rng([seed, count])
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
        middle = rng.uniform(6.0, 18.0, 2)
        places = middle + 14.0 * np.column_stack([np.cos(angles), turn * np.sin(angles)])
        slope, error = rng.normal(size=2) * 0.01, rng.choice([0.0, 0.05, 0.7, 3.0])
        values = 0.8 + (places - middle) @ slope
        outline = np.zeros((CORNERS, 3), dtype=np.float32)
        outline[:count] = np.column_stack([places, 1.0 / values])
        depth, tiles = np.zeros((24, 24), np.float32), np.zeros((3, 3, 3), np.float32)
        _draw_polygon(
            outline, count, np.float32(error), np.empty((CORNERS, 7), np.float32),
            np.empty((2, 6), np.float32), lens, size, depth, tiles,
        )  # fmt: skip
        for row, column in np.argwhere(depth > 0.0):
            corners = np.array([[column + x, row + y] for x in (-0.5, 0.5) for y in (-0.5, 0.5)])
            exact = (0.8 + (corners - middle) @ slope).min()
            pushed = exact / (1.0 + error * exact)
            assert depth[row, column] <= max(pushed, 1.0 / (outline[:count, 2].max() + error))
            if error == 0.0:
                assert depth[row, column] > exact - 1e-3
        pixels += np.count_nonzero(depth)
    assert pixels > 200


def test_tiles_that_a_triangle_passes_between_the_centres_are_left_alone():
    """Of a screen that is narrower than one."""
    camera = looking_ahead()
    buffer = DepthBuffer(2 * TILE, TILE)
    vertices = in_front(np.array([[0.55, 0.05], [0.551, 1.9], [0.552, 1.9]]) * TILE, camera, buffer)
    faces = np.array([[0, 1, 2]], np.int32)
    buffer.draw_mesh(vertices, faces, camera)
    assert not buffer.depth.any()
    vertices = in_front(np.array([[0.55, 0.05], [0.2, 1.9], [0.9, 1.9]]) * TILE, camera, buffer)
    buffer.draw_mesh(vertices, faces, camera)
    assert buffer.depth.any()


def in_front(places, camera, buffer):
    """The points at depth 2 that are seen at places of the screen, in pixels from its corner."""
    focal = 0.5 * buffer.rows / np.tan(np.radians(camera.fov) / 2.0)
    x = (places[:, 0] - 0.5 * buffer.columns) / focal
    y = (0.5 * buffer.rows - places[:, 1]) / focal
    return camera.position + 2.0 * np.column_stack([x, y, np.ones(len(x))]) @ camera.axes
