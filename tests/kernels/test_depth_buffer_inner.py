"""Inner coverage against many rays through every pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.geometry.camera import Camera
from tests.rasters import looking_ahead, nearest, random_camera

ROWS, COLUMNS, FINE = 11, 15, 16


def screen(buffer):
    return buffer.depth[: buffer.rows, : buffer.columns].astype(np.float64)


def drawn(vertices, faces, camera, coverage="inner", error=0.0, pairs=None):
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    buffer.draw_mesh(vertices, np.asarray(faces, np.int32), camera, error, pairs)
    return screen(buffer)


def by_pixel(fine):
    """(rows, columns, FINE^2) of (rows FINE, columns FINE)."""
    parts = fine.reshape(ROWS, FINE, COLUMNS, FINE).transpose(0, 2, 1, 3)
    return parts.reshape(ROWS, COLUMNS, -1)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_a_triangle_is_drawn_where_it_holds_the_whole_pixel_at_its_farthest(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    triangle = camera.position + rng.normal(size=(3, 3)) * rng.choice([0.3, 3.0, 50.0])
    depth = drawn(triangle, [[0, 1, 2]], camera)
    fine = by_pixel(nearest([triangle], camera, ROWS, COLUMNS, FINE)[0])
    least = fine.min(axis=2)
    assert (depth <= least).all()
    # Squares whose 256 rays all meet the triangle may still stick out by part of a ray's distance.
    wide = np.pad(fine.min(axis=2) > 0.0, 1)
    core = wide[1:-1, 1:-1] & wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:]
    push = 2.0**-20 / camera.near
    # The pixel's edge is half a ray's distance past its outermost rays.
    slope = (fine.max(axis=2) - least) / FINE
    assert (depth >= least - 1.1 * slope - push)[core].all()


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_triangle_seen_from_its_edge_draws_nothing(seed):
    """Wherever rounding puts its corners, each beside the line through the others."""
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    ahead, aside = rng.normal(size=3) + 3.0 * camera.axes[2], rng.normal(size=3)
    places = rng.uniform(0.5, 4.0, (4, 1)) * (ahead + rng.uniform(-2.0, 2.0, (4, 1)) * aside)
    vertices = camera.position + places
    for faces in ([[0, 1, 2]], [[0, 1, 2], [0, 1, 3]]):
        assert (drawn(vertices, faces, camera) == 0.0).all()


@pytest.mark.parametrize("turned", [False, True])
def test_a_pixel_is_inside_by_more_than_rounding(turned):
    """A corner that runs along borders of pixels, a little within or past them."""
    size = 9
    camera = Camera(np.zeros(3), np.diag([1.0, -1.0, 1.0]), 90.0, 0.1)
    for past, side in ((-1e-5, 5), (0.0, 5), (2e-4, 6)):
        low, high = 3.0 - past, 50.0
        places = np.array([[low, low], [high, low], [low, high]])[:: -1 if turned else 1]
        vertices = np.column_stack([(places - size / 2) / (size / 2) * 3.0, np.full(3, 3.0)])
        buffer = DepthBuffer(size, size, "inner")
        buffer.draw_mesh(vertices, np.array([[0, 1, 2]], np.int32), camera)
        assert np.count_nonzero(screen(buffer)) == side * side
        assert (screen(buffer)[size - side :, size - side :] > 0.0).all()


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_a_mesh_is_drawn_only_where_it_leaves_no_gap(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    vertices = camera.position + rng.normal(size=(9, 3)) * rng.choice([1.0, 4.0])
    faces = rng.integers(0, 9, (14, 3)).astype(np.int32)
    depth = drawn(vertices, faces, camera)
    fine, doubt = nearest(vertices[faces], camera, ROWS, COLUMNS, FINE)
    least = by_pixel(np.where(doubt, np.inf, fine)).min(axis=2)
    assert (depth <= least).all()
    assert (depth <= drawn(vertices, faces, camera, "centre") * (1.0 + 1e-5) + 1e-5).all()


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_pair_is_drawn_only_where_it_leaves_no_gap(seed):
    rng = np.random.default_rng(seed)
    camera = looking_ahead()
    local = np.column_stack([rng.uniform(-1.5, 1.5, (4, 2)), np.ones(4)])
    vertices = local * rng.uniform(1.0, 6.0, (4, 1)) @ camera.axes
    faces = np.array([[0, 1, 2], [1, 0, 3]], np.int32)
    fine, doubt = nearest(vertices[faces], camera, ROWS, COLUMNS, FINE)
    least = by_pixel(np.where(doubt, np.inf, fine)).min(axis=2)
    assert (drawn(vertices, faces, camera) <= least).all()


def test_nothing_is_lost_on_an_edge_of_two_triangles():
    """A slanted square across the screen, cut along each diagonal."""
    camera = looking_ahead()
    square = np.array([[-9, -9, 4], [9, -9, 6], [9, 9, 7], [-9, 9, 5]], dtype=np.float64)
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [3, 1, 2]]):
        assert (drawn(square, faces, camera) > 0.0).all()
        alone = drawn(square, faces, camera, pairs=np.empty((0, 2), np.uint32))
        assert 10 < np.count_nonzero(alone == 0.0) < 60


def test_a_fold_is_not_a_union():
    """Both triangles on the same side of their edge: the far side of it stays open."""
    camera = looking_ahead()
    vertices = np.array([[-3, -3.03, 4], [3, -3.01, 4], [0.2, 3, 4], [0, 3, 5.0]])
    depth = drawn(vertices, [[0, 1, 2], [0, 1, 3]], camera)
    fine, _ = nearest(vertices[[[0, 1, 2], [0, 1, 3]]], camera, ROWS, COLUMNS, FINE)
    assert (depth > 0.0).sum() > 30
    assert (depth <= by_pixel(fine).min(axis=2)).all()


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_an_error_pushes_away_by_at_least_itself_clipped_or_not(seed):
    rng = np.random.default_rng(seed)
    camera, error = random_camera(rng), rng.uniform(0.01, 2.0)
    vertices = camera.position + rng.normal(size=(6, 3)) * 3.0
    faces = rng.integers(0, 6, (6, 3)).astype(np.int32)
    fine, doubt = nearest(vertices[faces], camera, ROWS, COLUMNS, FINE)
    pushed = by_pixel(np.where(doubt, np.inf, fine / (1.0 + error * fine))).min(axis=2)
    assert (drawn(vertices, faces, camera, error=error) <= pushed).all()


def test_ground_through_the_camera_plane_is_drawn():
    camera = looking_ahead()
    corners = [[-200, -1.7, -200], [200, -1.7, -200], [200, -1.7, 200], [-200, -1.7, 200]]
    vertices = np.array(corners, dtype=np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    depth = drawn(vertices, faces, camera)
    whole = by_pixel(nearest(vertices[faces], camera, ROWS, COLUMNS, FINE)[0]).min(axis=2)
    assert (depth <= whole).all()
    assert np.count_nonzero(depth) > 0.8 * np.count_nonzero(whole) > 40
