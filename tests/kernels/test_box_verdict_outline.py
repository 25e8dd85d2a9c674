"""Boxes judged by their outline and their front, beside shapely and dense sampling."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import event, given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer, Verdict, screen_view
from simplifier.geometry.camera import Camera
from simplifier.kernels.box_verdict import is_outline_hidden, screen_outline
from simplifier.kernels.depth_buffer import STALE
from tests.rasters import looking_ahead, random_camera

ROWS, COLUMNS = 24, 32


def corners_of(box):
    return np.array(
        [[box[i, 0], box[j, 1], box[k, 2]] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    )


def random_box(rng, camera):
    """Before the near plane of the camera, on its screen for the most part."""
    while True:
        depth = rng.uniform(1.0, 8.0)
        across, along = rng.uniform(-0.7, 0.7, 2)
        centre = camera.position + depth * (np.array([across, along, 1.0]) @ camera.axes)
        half = rng.uniform(0.02, 0.6, 3) ** 2 * depth
        box = np.stack([centre - half, centre + half])
        if ((corners_of(box) - camera.position) @ camera.axes[2]).min() > camera.near:
            return box


def projected(points, camera):
    """(n, 2) pixels from the corner of the screen, and (n,) depths."""
    view = screen_view(camera, ROWS, COLUMNS)
    x, y, z = ((points - camera.position) @ view[3:12].reshape(3, 3).T).T
    return np.column_stack([x / z, y / z]), z


def hidden(box, camera, depth, grown=0.0):
    """By outline and front alone; ``grown`` besides what rounding takes."""
    buffer = DepthBuffer(ROWS, COLUMNS)
    buffer._look(camera)
    corners, bounds = np.zeros((2, 8), np.float32), np.zeros(6, np.float32)
    low, high = (box - camera.position).astype(np.float32)
    screen = buffer._screen.astype(np.float32)
    found = screen_outline(low, high, screen, buffer._lens, buffer._size, corners, bounds)
    if found == Verdict.OUTSIDE:  # of the screen, where nothing of it is to be seen
        return True
    value = np.float32(1.0) / bounds[4]
    room = np.zeros((12, 7), np.float32), np.zeros((3, 3), np.float32), bounds
    return is_outline_hidden(
        low, high, camera.axes, buffer._lens, buffer._size, depth.astype(np.float32), value,
        np.float32(grown), corners, *room,
    )  # fmt: skip


def outline_pixels(box, camera, grown):
    """(ROWS, COLUMNS) whose squares meet the outline; -1 out, 1 in, 0 where the two only touch.

    Or where they meet the bounds of an edge that rises by less than a pixel, which counts whole.
    """
    places, _ = projected(corners_of(box), camera)
    outline = shapely.convex_hull(shapely.MultiPoint(places))
    r, c = np.indices((ROWS, COLUMNS))
    squares = shapely.box(c - grown, r - grown, c + 1 + grown, r + 1 + grown)
    shared = shapely.area(shapely.intersection(squares, outline))
    near = shapely.distance(squares, outline) < 4e-3
    for corner, axis in itertools.product(range(8), range(3)):
        ends = places[[corner, corner ^ (1 << axis)]]
        if np.ptp(ends[:, 1]) <= 1.0:
            near |= (
                shapely.distance(squares, shapely.box(*ends.min(axis=0), *ends.max(axis=0))) < 4e-3
            )
    return np.where(shared > 1e-6, 1, np.where(near, 0, -1))


def entry(box, camera, rows, columns):
    """Reciprocal depth at which rays through places of the screen enter the box; NaN for a miss."""
    view = screen_view(camera, ROWS, COLUMNS)
    inverse = np.linalg.inv(view[3:12].reshape(3, 3))
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ inverse.T
    with np.errstate(divide="ignore"):
        ends = (box[:, None, None, :] - camera.position) / rays
    begin, end = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    return np.where(begin <= end, 1.0 / begin, np.nan)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.5, 2.5]))
def test_all_pixels_of_the_outline_count_and_no_others(seed, grown):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    box = random_box(rng, camera)
    meets = outline_pixels(box, camera, grown)
    depth = np.where(meets >= 0, 1e3, 0.0).astype(np.float32)
    assert hidden(box, camera, depth, grown)
    if hidden(box, camera, np.zeros_like(depth), grown):
        return  # it is beside the screen
    inside = np.argwhere(meets == 1)
    for row, column in inside[rng.permutation(len(inside))[:10]]:
        holed = depth.copy()
        holed[row, column] = 0.0
        assert not hidden(box, camera, holed, grown)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_buffer_just_before_the_front_hides_and_one_behind_it_does_not(seed):
    """The front is sampled at 9 x 9 places of each pixel."""
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    box = random_box(rng, camera)
    steps = (np.arange(9) + 0.5) / 9.0
    rows, columns = np.meshgrid(np.arange(ROWS), np.arange(COLUMNS), indexing="ij")
    fronts = np.array([
        entry(box, camera, rows + dy, columns + dx) for dy, dx in itertools.product(steps, steps)
    ])  # fmt: skip
    nearest = np.nanmax(np.where(np.isnan(fronts), 0.0, fronts), axis=0)
    if nearest.max() == 0.0:  # off the screen, or between the samples
        event("not seen")
        return
    # A hole where the box is nearer than what is drawn is always found.
    seen = np.argwhere(nearest > 0.0)
    for row, column in seen[rng.permutation(len(seen))[:10]]:
        depth = np.full((ROWS, COLUMNS), 1e3, dtype=np.float32)
        depth[row, column] = nearest[row, column] * (1.0 - 1e-5)
        assert not hidden(box, camera, depth)
    # And what is just before the front hides it, which a pixel's corners tell by each side.
    meets = outline_pixels(box, camera, 0.0) >= 0
    bounded = np.where(meets, front_bound(box, camera) * (1.0 + 1e-3), 0.0)
    assert hidden(box, camera, bounded.astype(np.float32))


def front_bound(box, camera):
    """(ROWS, COLUMNS): the least over the sides that face the camera of the most in a pixel."""
    view = screen_view(camera, ROWS, COLUMNS)
    inverse = np.linalg.inv(view[3:12].reshape(3, 3))
    rows, columns = np.meshgrid(np.arange(ROWS + 1.0), np.arange(COLUMNS + 1.0), indexing="ij")
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ inverse.T
    bound = np.full((ROWS, COLUMNS), 1.0 / projected(corners_of(box), camera)[1].min())
    for axis in range(3):
        low, high = box[:, axis] - camera.position[axis]
        if low <= 0.0 <= high:
            continue
        side = rays[..., axis] / (low if low > 0.0 else high)
        ends = [side[:-1, :-1], side[1:, :-1], side[:-1, 1:], side[1:, 1:]]
        bound = np.minimum(bound, np.max(ends, axis=0))
    return bound


def test_a_long_wall_behind_one_that_runs_along_is_hidden():
    """Its rectangle at its nearest corner is not: that is what the front is for."""
    camera = looking_ahead()
    view = screen_view(camera, ROWS, COLUMNS)
    behind = np.array([[-1.9, -0.2, 2.0], [-1.7, 0.2, 8.0]])
    rows, columns = np.meshgrid(np.arange(ROWS) + 0.5, np.arange(COLUMNS) + 0.5, indexing="ij")
    inverse = np.linalg.inv(view[3:12].reshape(3, 3))
    rays = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ inverse.T
    wall = rays[..., 0] / -1.0  # the plane x = -1, as reciprocal depth
    depth = np.where(wall > 0.0, wall, 0.0).astype(np.float32)
    assert hidden(behind, camera, depth)
    places, depths = projected(corners_of(behind), camera)
    low, high = np.maximum(places.min(axis=0), 0), np.minimum(places.max(axis=0), [COLUMNS, ROWS])
    (left, top), (right, bottom) = low.astype(int), np.ceil(high).astype(int)
    assert not (depth[top:bottom, left:right] > 1.0 / depths.min()).all()
    before = behind + np.array([0.9, 0.0, 0.0])
    assert not hidden(before, camera, depth)
    buffer = DepthBuffer(ROWS, COLUMNS, "inner")
    buffer.depth[:] = depth
    buffer.tiles[STALE] = 1.0
    found = buffer.test(np.stack([behind, before]), camera)
    assert found.tolist() == [Verdict.HIDDEN, Verdict.VISIBLE]


@pytest.mark.parametrize("axis", range(3))
def test_a_flat_box(axis):
    camera = looking_ahead()
    box = np.array([[-0.5, -0.5, 4.0], [0.5, 0.5, 5.0]])
    box[1, axis] = box[0, axis]
    depth = np.full((ROWS, COLUMNS), 0.3, dtype=np.float32)
    assert hidden(box, camera, depth)
    assert not hidden(box, camera, np.full((ROWS, COLUMNS), 0.1, dtype=np.float32))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_a_side_whose_plane_the_camera_is_in_says_nothing_of_the_front(axis, side, turn):
    """However it is turned: a reciprocal depth there would be without bounds."""
    forward = np.array([0.3 * turn, 0.2 * turn, 1.0])
    camera = Camera.looking(np.zeros(3), forward, np.array([0.05, 1.0, 0.0]), 70.0, 0.25)
    box = np.array([[-0.4, -0.4, 3.0], [0.4, 0.4, 4.0]])
    box[side, axis] = 0.0
    meets = outline_pixels(box, camera, 0.0) >= 0
    assert meets.any()
    for share, expected in ((1.0 + 1e-4, True), (0.9, False)):
        depth = np.where(meets, front_bound(box, camera) * share, 0.0).astype(np.float32)
        assert hidden(box, camera, depth) == expected
