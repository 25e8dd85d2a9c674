"""Depths and coarse levels against rays cast through every pixel."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely import MultiPoint, contains_xy

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.geometry.camera import Lens
from simplifier.kernels.depth_buffer import ERROR, FARTHEST, PAST, STALE, TILE
from tests.rasters import (
    LATTICE,
    hits,
    lattice_mesh,
    lattice_places,
    looking_ahead,
    nearest,
    random_camera,
    rays,
)

ROWS, COLUMNS = 21, 35


def drawn(triangles, camera, error=0.0):
    buffer = DepthBuffer(ROWS, COLUMNS)
    buffer.draw(np.asarray(triangles, dtype=np.float64), camera, error)
    return buffer


def screen(buffer):
    return buffer.depth[: buffer.rows, : buffer.columns].astype(np.float64)


def around(triangles, camera):
    """Least and most reciprocal depth, of the nearest, that rays meet within the slack of a centre.

    0 is least where one of them misses.
    """
    focal = Lens(ROWS, camera.fov).focal
    right, up, _ = camera.axes
    step = 1.02 * DepthBuffer(ROWS, COLUMNS).slack / focal
    found = []
    for across, down in product((-step, 0.0, step), repeat=2):
        directions = rays(camera, ROWS, COLUMNS) + across * right + down * up
        each = [hits(triangle, camera, directions) for triangle in triangles]
        depth = np.max([depth for depth, _ in each], axis=0)
        doubt = np.any([doubt for _, doubt in each], axis=0)
        found.append((np.where(doubt, 0.0, depth), np.where(doubt, np.inf, depth)))
    return np.min([least for least, _ in found], axis=0), np.max([m for _, m in found], axis=0)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_covers_what_rays_meet_and_is_never_nearer(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    triangles = camera.position + rng.normal(size=(5, 3, 3)) * rng.choice([0.3, 2.0, 50.0])
    depth = screen(drawn(triangles, camera))
    least, most = around(triangles, camera)
    assert (depth <= most).all()
    # A triangle holds its farthest corner's depth at least, which may be past all numbers.
    assert (depth[least > 2e-6 / camera.near] > 0.0).all()


def test_what_rounding_is_paid_for_with_is_little():
    """More for slender triangles, which are few."""
    lost = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        camera = random_camera(rng)
        triangles = camera.position + rng.normal(size=(5, 3, 3)) * rng.choice([0.3, 2.0, 50.0])
        least, _ = around(triangles, camera)
        lost.append((least - screen(drawn(triangles, camera)))[least > 0.0] * camera.near)
    assert np.quantile(np.concatenate(lost), [0.9, 0.99]) == pytest.approx(0.0, abs=3e-4)


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_an_error_pushes_away_by_at_least_itself(seed):
    rng = np.random.default_rng(seed)
    camera, error = random_camera(rng), rng.uniform(0.01, 2.0)
    triangle = camera.position + rng.normal(size=(3, 3)) * 3.0
    depth = screen(drawn([triangle], camera, error))
    expected, doubt = hits(triangle, camera, rays(camera, ROWS, COLUMNS))
    pushed = expected / (1.0 + error * expected)
    assert (depth <= pushed)[~doubt].all()
    exact = screen(drawn([triangle], camera))
    farthest = 1.0 / ((triangle - camera.position) @ camera.axes[2])
    if (farthest > 0.0).all() and (farthest < 1.0 / camera.near).all():
        least = farthest.min() / (1.0 + error * farthest.min())
        assert (depth[exact > 0.0] >= least * (1.0 - 1e-5) - 1e-5).all()


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
@example(18659)  # all that a triangle has of a tile is behind another one, or past the screen
def test_tiles_know_the_error_of_what_is_seen_in_them(seed):
    rng = np.random.default_rng(seed)
    camera, errors = random_camera(rng), rng.uniform(0.0, 1.0, 4)
    triangles = camera.position + rng.normal(size=(4, 3, 3)) * 3.0
    buffer, most = drawn(triangles, camera, errors), 0.0
    for triangle, error in zip(triangles, errors, strict=True):
        alone = drawn([triangle], camera, error)
        focal = error * Lens(ROWS, camera.fov).focal
        nearest = max(((triangle - camera.position) @ camera.axes[2]).min(), camera.near)
        met = alone.tiles[STALE] == 1.0
        exact = drawn([triangle], camera).depth
        exact[exact == PAST] = 0.0
        assert (alone.tiles[ERROR] >= focal * in_tiles(exact, np.max) * met * (1.0 - 1e-6)).all()
        assert (alone.tiles[ERROR] <= focal / nearest * (1.0 + 1e-5)).all()
        shows = (buffer.depth == alone.depth) & (alone.depth > 0.0) & (alone.depth < PAST)
        seen = in_tiles(shows, np.any) & met
        assert (buffer.tiles[ERROR][seen] >= alone.tiles[ERROR][seen]).all()
        most = np.maximum(most, alone.tiles[ERROR])
    assert (buffer.tiles[ERROR] <= most).all()
    assert (buffer.tiles[FARTHEST] <= in_tiles(buffer.depth, np.min)).all()


def in_tiles(values, reduced):
    """Of each tile's pixels."""
    return reduced(values.reshape(-(-ROWS // TILE), TILE, -1, TILE), axis=(1, 3))


@settings(max_examples=40)
@given(lattice_places)
def test_no_pinhole_between_triangles_that_share_edges(places):
    mesh = lattice_mesh(places)
    if mesh is None:
        return
    points, vertices, faces, camera = mesh
    buffer = DepthBuffer(LATTICE, LATTICE)
    buffer.draw_mesh(vertices, faces, camera)
    x, y = np.meshgrid(np.arange(LATTICE) + 0.5, np.arange(LATTICE) + 0.5)
    hull = MultiPoint(points).convex_hull
    inside = contains_xy(hull.buffer(-1e-9), LATTICE - x, LATTICE - y)
    assert (screen(buffer)[inside] > 0.0).all()


@pytest.mark.parametrize(
    "triangle",
    [
        [[0.0, 0.0, 4.0]] * 3,
        [[-1.0, 0.0, 4.0], [0.0, 0.0, 4.0], [1.0, 0.0, 4.0]],
        [[-1.0, 0.0, -4.0], [0.0, 1.0, -4.0], [1.0, 0.0, -4.0]],  # behind
        [[np.nan, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[np.inf, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[-np.inf, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
        [[1e200, 0.0, 4.0], [0.0, 1.0, 4.0], [1.0, 0.0, 4.0]],
    ],
)
def test_draws_nothing_of_what_has_no_area_or_place(triangle):
    buffer = drawn([triangle], looking_ahead())
    assert (screen(buffer) == 0.0).all()
    assert (buffer.tiles == 0.0).all()


def test_ground_that_goes_through_the_camera_plane_and_far_out():
    """Coordinates of billions of pixels before they are clipped."""
    camera = looking_ahead(near=0.01)
    triangle = np.array([[-1e7, -1.7, -1e7], [1e7, -1.7, -1e7], [0.0, -1.7, 1e7]])
    depth = screen(drawn([triangle], camera))
    expected, doubt = nearest([triangle], camera, ROWS, COLUMNS)
    assert (expected > 0.0).sum() > 100
    assert ((depth > 0.0) == (expected > 1e-4))[
        ~doubt & ((expected == 0) | (expected > 1e-3))
    ].all()
    np.testing.assert_allclose(depth[~doubt], expected[~doubt], atol=1e-4)
