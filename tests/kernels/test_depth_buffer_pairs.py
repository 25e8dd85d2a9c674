"""The pixels across an edge that two triangles share, one pair at a time."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box
from shapely.ops import unary_union

from simplifier.kernels.depth_buffer import (
    CORNERS,
    ERROR,
    FOCAL,
    NEAR,
    SLACK,
    STALE,
    TILE,
    _draw_pairs,
)

SIZE = 2 * TILE  # rows and columns of the screen
LENS = np.zeros(4)
LENS[[FOCAL, NEAR, SLACK]] = 10.0, 0.1, SIZE / 262_144
FACES = np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int32)
PAIR = np.array([[2, 5]], dtype=np.uint32)  # corners opposite of the edge from 0 to 1
PUSH = 1e-3  # what rounding is paid for with, at most, of thick triangles


def drawn(points, error=0.0, other=0.0):
    """Depths and tiles of a pair alone, without its triangles."""
    depth = np.zeros((SIZE, SIZE), dtype=np.float32)
    tiles = np.zeros((3, 2, 2), dtype=np.float32)
    planes, edges = np.zeros((2, 6), np.float32), np.full((CORNERS, 7), -1.0, np.float32)
    corners = np.ascontiguousarray(np.asarray(points).T, dtype=np.float32)
    _draw_pairs(
        FACES, PAIR, np.array([error, other], np.float32), edges, planes, LENS,
        np.array([SIZE, SIZE]), depth, tiles, corners,
    )  # fmt: skip
    return depth, tiles


def least_value(corners, error, row, column):
    """Of the pushed reciprocal depth over a pixel, which is no farther than the farthest corner."""
    values = 1.0 / (corners[:, 2] + error)
    plane = np.linalg.solve(np.column_stack([corners[:, :2], np.ones(3)]), values)
    at_corners = [
        plane @ [column + x, row + y, 1.0] for x in (-0.5, 0.5) for y in (-0.5, 0.5)
    ]  # fmt: skip
    return max(min(at_corners), values.min())


def check(points, depth, tiles, error, other):
    """Only pixels of the union, at the farther of both triangles, and the tiles know of it."""
    points = np.asarray(points, dtype=np.float32).astype(np.float64)
    union = unary_union([Polygon(points[[0, 1, 2], :2]), Polygon(points[[0, 1, 3], :2])])
    allowed = union.buffer(1e-9)
    nearest = 1.0 / points[:, 2].min()
    for row, column in np.argwhere(depth > 0.0):
        assert allowed.covers(box(column - 0.5, row - 0.5, column + 0.5, row + 0.5))
        exact = min(
            least_value(points[[0, 1, 2]], error, row, column),
            least_value(points[[0, 1, 3]], other, row, column),
        )
        assert depth[row, column] <= exact
    met = (depth > 0.0).reshape(2, TILE, 2, TILE).any(axis=(1, 3))
    blur = max(error, other) * 10.0 * nearest
    assert (tiles[STALE] >= met).all()
    assert (tiles[ERROR] >= blur * met).all()
    np.testing.assert_allclose(tiles[ERROR], blur * (tiles[STALE] == 1.0), rtol=1e-5)


def test_any_pair_is_drawn_within_its_union_and_no_nearer_than_it_is():
    pixels = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points = np.column_stack([rng.uniform(-4.0, 20.0, (4, 2)), rng.uniform(0.5, 5.0, 4)])
        if seed % 3 == 0:  # thin, so that a plane is steep and the farthest corner stands in
            points[2, :2] = points[0, :2] + 0.4 * (points[1, :2] - points[0, :2])
            points[2, :2] += rng.uniform(-3.0, 3.0, 2)
        error, other = rng.choice([0.0, 0.3, 2.0], 2)
        depth, tiles = drawn(points, error, other)
        check(points, depth, tiles, error, other)
        pixels += np.count_nonzero(depth)
    assert pixels > 100


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("at", [5.3, 5.5, 5.7, 7.1])
@pytest.mark.parametrize("away", [0.1, 1.0])
@pytest.mark.parametrize("swapped", [False, True])
def test_all_pixels_on_a_level_or_upright_edge_are_drawn(turn, at, swapped, away):
    """From one end of the screen to the other."""
    points = np.array(
        [[-9.0, at, 2.0], [30.0, at, 3.0], [12.0, at + 40.0, 1.5], [2.0, at - 40.0, 4.0]]
    )
    if swapped:
        points = points[[1, 0, 3, 2]]
    points[:, 2] *= away
    for _ in range(turn):
        points[:, :2] = np.column_stack([SIZE - 1.0 - points[:, 1], points[:, 0]])
    depth, tiles = drawn(points, 0.2, 0.1)
    check(points, depth, tiles, 0.2, 0.1)
    upright = np.rot90(depth, turn)
    met = np.abs(np.arange(SIZE) - at) < 0.5
    assert met.any() or at == 5.5
    assert (upright[met, 1:-1] > 0.0).all()
    assert not upright[np.abs(np.arange(SIZE) - at) > 0.6].any()


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [1, 0, 2, 3], [0, 1, 3, 2], [1, 0, 3, 2]])
def test_a_sliver_completes_the_pixels_that_it_has_a_part_of(order):
    """Of less than half a pixel's area, a tenth of a pixel high."""
    places = [[3.0, 5.45], [11.0, 5.45], [7.0, 5.55], [7.0, -40.0]]
    points = np.column_stack([places, [2.0, 3.0, 2.0, 2.0]])[order]
    depth, tiles = drawn(points)
    check(points, depth, tiles, 0.0, 0.0)
    assert np.argwhere(depth > 0.0).tolist() == [[5, 6], [5, 7], [5, 8]]


@pytest.mark.parametrize("edge", [(0.0, 1.0), (1.0, 0.0), (0.3, 0.9), (-0.5, 0.01), (0.01, 0.02)])
def test_a_fold_draws_nothing_whichever_way_its_edge_runs(edge):
    along = np.array(edge)
    middle, aside = np.array([7.2, 7.4]), np.array([-along[1], along[0]])
    reach = 9.0 / np.abs(along).max()
    for side in (-1.0, 1.0):
        places = [
            middle - reach * along, middle + reach * along,
            middle + side * 9.0 * reach * aside, middle + side * 7.0 * reach * aside + along,
        ]  # fmt: skip
        depth, tiles = drawn(np.column_stack([places, np.full(4, 2.0)]))
        assert not depth.any()
        assert not tiles.any()
        places[3] = middle - side * 7.0 * reach * aside + along
        assert drawn(np.column_stack([places, np.full(4, 2.0)]))[0].any()


@pytest.mark.parametrize("behind", range(4))
def test_a_pair_with_a_corner_that_was_not_projected_draws_nothing(behind):
    points = np.array([[-9.0, 5.3, 2.0], [30.0, 6.3, 3.0], [12.0, 40.0, 1.5], [2.0, -40.0, 4.0]])
    assert drawn(points)[0].any()
    points[behind, 2] = -1.0
    for error in (0.0, 3.0):
        depth, tiles = drawn(points, error, error)
        assert not depth.any()
        assert not tiles.any()


@pytest.mark.parametrize("same", [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), None])
@pytest.mark.parametrize("gap", [0.0, 1e-14, 1e-5])
def test_a_pair_without_an_area_on_one_side_draws_nothing(same, gap):
    """Two corners at one place, or all; or all of a triangle's on a line."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        points = np.column_stack([rng.uniform(-9.0, 24.0, (4, 2)), rng.uniform(1.0, 3.0, 4)])
        points[:2, :2] = [[-9.0, 5.3], [24.0, 6.3]] if seed % 2 else points[:2, :2]
        away = gap * rng.uniform(-1.0, 1.0, 2)
        if same is None:
            between = rng.uniform(-1.0, 2.0) * (points[1, :2] - points[0, :2])
            points[2, :2] = points[0, :2] + between + away
        else:
            points[same[1], :2] = points[same[0], :2] + away
        assert not drawn(points)[0].any()
        points[:, :2] = points[seed % 4, :2] + gap * rng.uniform(-1.0, 1.0, (4, 2))
        assert not drawn(points)[0].any()


def test_the_values_of_a_pair_are_those_of_the_farther_triangle():
    """Of flat and of steep ones; what is nearer already stays."""
    compared = 0
    for seed in range(80):
        rng = np.random.default_rng(seed)
        points = np.array([[-9.0, 5.3], [24.0, 8.3], [12.0, 40.0], [2.0, -40.0]])
        points = np.column_stack([points + rng.uniform(-2.0, 2.0, (4, 2)), rng.uniform(2, 5, 4)])
        if seed % 4 == 0:
            points[:, 2] = 2.0
        error, other = rng.choice([0.0, 0.3, 2.0], 2)
        depth, _ = drawn(points, error, other)
        for row, column in np.argwhere(depth > 0.0):
            mine = least_value(points[[0, 1, 2]], error, row, column)
            exact = min(mine, least_value(points[[0, 1, 3]], other, row, column))
            assert exact - PUSH <= depth[row, column] <= exact + 1e-6
            compared += 1
    assert compared > 500
