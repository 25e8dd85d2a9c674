"""Rectangles of boxes and blocks of pixels, one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer, Verdict, screen_view
from simplifier.geometry.camera import Camera
from simplifier.kernels.box_verdict import is_block_nearer, largest_blur, screen_outline
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, STALE, TILE
from tests.rasters import random_camera

ROWS, COLUMNS = 24, 32
AHEAD = Camera(np.zeros(3), np.diag([1.0, -1.0, 1.0]), 90.0, 0.25)


def corners_of(box):
    return np.array(
        [[box[i, 0], box[j, 1], box[k, 2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    )


def outline(box, camera, rows=ROWS, columns=COLUMNS):
    """Verdict, pixels (2, 8) and bounds as the kernel has them."""
    buffer = DepthBuffer(rows, columns)
    buffer._look(camera)
    corners, bounds = np.zeros((2, 8), np.float32), np.zeros(6, np.float32)
    low, high = (box - camera.position).astype(np.float32)
    found = screen_outline(
        low, high, buffer._screen.astype(np.float32), buffer._lens, buffer._size, corners, bounds
    )
    return found, corners.astype(np.float64), bounds.astype(np.float64)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_rectangle_holds_the_corners_to_what_it_says_it_is_off_by(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    centre = camera.position + rng.normal(size=3) * 5.0
    half = rng.uniform(0.01, 1.5, 3)
    box = np.stack([centre - half, centre + half])
    view = screen_view(camera, ROWS, COLUMNS)
    x, y, z = ((corners_of(box) - view[:3]) @ view[3:12].reshape(3, 3).T).T
    planes = (x, y, COLUMNS * z - x, ROWS * z - y, z - camera.near)
    found, corners, bounds = outline(box, camera)
    reached = min(plane.max() for plane in planes)
    if reached < -1e-2:
        assert found == Verdict.OUTSIDE
    elif reached > 1e-2 and abs(z.min() - camera.near) > 1e-3:
        assert found == (Verdict.VISIBLE if z.min() < camera.near else Verdict.HIDDEN)
    if found == Verdict.HIDDEN:
        slack = bounds[5]
        assert slack < 0.1 * max(1.0, 1.0 / z.min())
        np.testing.assert_allclose(corners[0], x / z, atol=slack)
        np.testing.assert_allclose(corners[1], y / z, atol=slack)
        exact = [(x / z).min(), (x / z).max(), (y / z).min(), (y / z).max()]
        assert bounds[:4] == pytest.approx(exact, abs=slack)
        assert z.min() * (1.0 - 1e-4) - 1e-4 < bounds[4] < z.min()


def test_a_box_on_a_plane_of_the_frustum_is_not_outside():
    """It shares a line of pixels with the screen, or a point of the near plane."""
    for low, high, expected in (
        ([1.0, 0.0, 1.0], [2.0, 0.5, 1.0], Verdict.HIDDEN),
        ([-2.0, 0.0, 1.0], [-1.0, 0.5, 1.0], Verdict.HIDDEN),
        ([0.0, 1.0, 1.0], [0.5, 2.0, 1.0], Verdict.HIDDEN),
        ([0.0, -2.0, 1.0], [0.5, -1.0, 1.0], Verdict.HIDDEN),
        ([0.0, 0.0, 0.0], [0.1, 0.1, 0.25], Verdict.VISIBLE),
        ([1.01, 0.0, 1.0], [2.0, 0.5, 1.0], Verdict.OUTSIDE),
        ([0.0, -2.0, 1.0], [0.5, -1.01, 1.0], Verdict.OUTSIDE),
        ([0.0, 0.0, 0.0], [0.1, 0.1, 0.24], Verdict.OUTSIDE),
    ):
        assert outline(np.array([low, high]), AHEAD, 4, 4)[0] == expected


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e38])
@pytest.mark.parametrize("place", [(0, 0), (1, 2)])
def test_what_is_no_box_is_visible(value, place):
    box = np.array([[-0.5, -0.5, 2.0], [0.5, 0.5, 3.0]])
    box[place] = value
    with np.errstate(over="ignore"):
        assert outline(box, AHEAD)[0] == Verdict.VISIBLE


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


def verdict_behind(depth, box):
    """By a buffer of inner coverage whose pixels are those."""
    buffer = DepthBuffer(*depth.shape, "inner")
    buffer.depth[: depth.shape[0], : depth.shape[1]] = depth
    buffer.tiles[STALE] = 1.0
    return Verdict(buffer.test(box[None], AHEAD)[0])


@pytest.mark.parametrize("open_pixel", [(1, 1), (1, 3), (3, 1), (3, 3), (2, 1), (1, 2)])
def test_a_rectangle_that_only_touches_a_pixel_asks_for_it(open_pixel):
    """By its corner or its side: rounding must not decide that."""
    box = np.array([[-0.5, -0.5, 1.0], [-0.25, -0.25, 1.0]])  # the pixel of row 2, column 2
    depth = np.full((TILE, TILE), 2.0, dtype=np.float32)
    depth[open_pixel] = 0.5
    assert verdict_behind(depth, box) == Verdict.VISIBLE
    depth[:], depth[0] = 2.0, 0.5
    assert verdict_behind(depth, box) == Verdict.HIDDEN


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [0, 1])
def test_a_camera_in_the_plane_of_a_side_does_not_see_that_side(axis, side):
    """The front alone decides: what is just nearer hides the box."""
    box = np.array([[-0.3, -0.3, 2.0], [0.3, 0.3, 3.0]])
    box[side, axis] = 0.0
    for share, expected in ((1e-5, Verdict.HIDDEN), (-1e-5, Verdict.VISIBLE)):
        depth = np.full((TILE, TILE), 0.5 * (1.0 + share), dtype=np.float32)
        depth[0] = 0.0  # past its outline; with it all shortcuts are tried
        assert verdict_behind(depth, box) == expected
