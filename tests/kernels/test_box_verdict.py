"""Rectangles of boxes and blocks of pixels, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import Verdict, screen_view
from simplifier.kernels.box_verdict import (
    is_block_nearer,
    judge_boxes,
    largest_blur,
    least_of,
    mark_outside,
    screen_rectangle,
)
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, STALE, TILE
from tests.rasters import random_camera

ROWS, COLUMNS = 24, 32


def corners_of(box):
    return np.array(
        [[box[i, 0], box[j, 1], box[k, 2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    )


def homogeneous(box, view):
    return (corners_of(box) - view[:3]) @ view[3:12].reshape(3, 3).T


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_rectangle_holds_the_corners_and_touches_them_on_all_sides(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    centre = camera.position + rng.normal(size=3) * 5.0
    half = rng.uniform(0.01, 1.5, 3)
    box = np.stack([centre - half, centre + half])
    view = screen_view(camera, ROWS, COLUMNS)
    x, y, z = homogeneous(box, view).T
    planes = (x, y, COLUMNS * z - x, ROWS * z - y, z - camera.near)
    found, *bounds = screen_rectangle(box[None], 0, view)
    outside = np.empty(1, dtype=np.bool_)
    mark_outside(box[None], view, outside)
    assert outside[0] == (found == Verdict.OUTSIDE)
    if any((plane < 0.0).all() for plane in planes):
        assert found == Verdict.OUTSIDE
    elif z.min() < camera.near:
        assert found == Verdict.VISIBLE
    else:
        assert found == Verdict.HIDDEN
        expected = [(x / z).min(), (x / z).max(), (y / z).min(), (y / z).max(), z.min()]
        assert bounds == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_box_on_a_plane_of_the_frustum_is_not_outside():
    """It shares a line of pixels with the screen, or a point of the near plane."""
    view = np.array([0, 0, 0, -2, 0, 2, 0, -2, 2, 0, 0, 1, 2, 0.25, 4, 4])  # a right angle's
    boxes = np.array([
        [[1.0, 0.0, 1.0], [2.0, 0.5, 1.0]], [[-2.0, 0.0, 1.0], [-1.0, 0.5, 1.0]],
        [[0.0, 1.0, 1.0], [0.5, 2.0, 1.0]], [[0.0, -2.0, 1.0], [0.5, -1.0, 1.0]],
        [[0.0, 0.0, 0.0], [0.1, 0.1, 0.25]],
    ])  # fmt: skip
    outside = np.empty(len(boxes), dtype=np.bool_)
    mark_outside(boxes, view, outside)
    assert not outside.any()
    assert screen_rectangle(boxes, 4, view)[0] == Verdict.VISIBLE
    at_near = np.array([[[0.0, 0.0, 0.25], [0.1, 0.1, 0.5]]])
    assert screen_rectangle(at_near, 0, view)[0] == Verdict.HIDDEN


@settings(max_examples=80)
@given(st.integers(0, 2**32 - 1))
def test_a_block_is_nearer_when_all_of_its_pixels_are(seed):
    rng = np.random.default_rng(seed)
    depth = np.ones((3 * TILE, 4 * TILE), dtype=np.float32)
    depth[rng.integers(0, 3 * TILE, 4), rng.integers(0, 4 * TILE, 4)] = 0.5
    tiles = np.zeros((3, 3, 4), dtype=np.float32)
    tiles[ERROR] = rng.uniform(0.0, 3.0, (3, 4))
    # Fresh ones hold their least; stale ones may hold what was true before more was drawn.
    least = depth.reshape(3, TILE, 4, TILE).min(axis=(1, 3))
    stale = rng.random((3, 4)) < 0.5
    tiles[FARTHEST], tiles[STALE] = np.where(stale, 0.0, least), stale
    rows, columns = np.sort(rng.integers(0, 3 * TILE, 2)), np.sort(rng.integers(0, 4 * TILE, 2))
    block = depth[rows[0] : rows[1] + 1, columns[0] : columns[1] + 1]
    assert least_of(depth, *rows, *columns) == block.min()
    met = tiles[
        ERROR, rows[0] // TILE : rows[1] // TILE + 1, columns[0] // TILE : columns[1] // TILE + 1
    ]
    assert largest_blur(tiles, *rows, *columns) == met.max()
    for value in rng.permutation([0.25, 0.5, 0.75, 1.0]):
        found = is_block_nearer(depth, tiles, np.float32(value), *rows, *columns)
        assert found == (block > value).all()
        # What was made fresh is right, and what was right is left alone.
        assert (tiles[FARTHEST] <= least).all()
        assert (tiles[FARTHEST] == least)[tiles[STALE] == 0.0].all()


@pytest.mark.parametrize("open_pixel", [(1, 1), (1, 3), (3, 1), (3, 3), (2, 1), (1, 2)])
def test_a_rectangle_that_only_touches_a_pixel_asks_for_it(open_pixel):
    """By its corner or its side: rounding must not decide that."""
    view = np.array([0, 0, 0, -4, 0, 4, 0, -4, 4, 0, 0, 1, 4, 0.25, 8, 8], dtype=np.float64)
    box = np.array([[[0.25, 0.25, 1.0], [0.5, 0.5, 1.0]]])  # the pixel of row 2, column 2
    depth = np.full((TILE, TILE), 2.0, dtype=np.float32)
    depth[open_pixel] = 0.5
    tiles = np.zeros((3, 1, 1), dtype=np.float32)
    tiles[STALE] = 1.0
    verdicts = np.empty(1, dtype=np.uint8)
    judge_boxes(box, view, depth, tiles, 0.0, verdicts)
    assert verdicts[0] == Verdict.VISIBLE
    depth[:], depth[0], tiles[FARTHEST], tiles[STALE] = 2.0, 0.5, 0.0, 1.0
    judge_boxes(box, view, depth, tiles, 0.0, verdicts)
    assert verdicts[0] == Verdict.HIDDEN


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [0, 1])
def test_a_camera_in_the_plane_of_a_side_does_not_see_that_side(axis, side):
    """The front alone decides: what is just nearer hides the box."""
    view = np.array([0, 0, 0, -4, 0, 4, 0, -4, 4, 0, 0, 1, 4, 0.25, 8, 8], dtype=np.float64)
    box = np.array([[[-0.3, -0.3, 2.0], [0.3, 0.3, 3.0]]])
    box[0, side, axis] = 0.0
    tiles, verdicts = np.zeros((3, 1, 1), dtype=np.float32), np.empty(1, dtype=np.uint8)
    for share, expected in ((1e-5, Verdict.HIDDEN), (-1e-5, Verdict.VISIBLE)):
        depth = np.full((TILE, TILE), 0.5 * (1.0 + share), dtype=np.float32)
        tiles[FARTHEST], tiles[STALE] = 0.0, 1.0
        depth[0] = 0.0  # past its outline; with it all shortcuts are tried
        judge_boxes(box, view, depth, tiles, 0.0, verdicts)
        assert verdicts[0] == expected
