"""Coverage masks against exact edge functions, shapely hulls and their own symmetries."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from shapely import MultiPoint, contains_xy

from simplifier.geometry.views import image_axes, random_directions
from simplifier.kernels.coverage import coverage_masks, unpack_masks

FLAT = np.array([[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]])
"""One view that takes x and y for pixel coordinates."""


def draw(corners, rows, columns):
    """Mask of a soup of (m, 3, 2) pixel coordinates: (rows, columns) bool."""
    flat = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    points = np.column_stack([flat, np.zeros(len(flat))])
    faces = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
    return unpack_masks(coverage_masks(points, faces, FLAT, rows, columns), columns)[0]


def edge_functions(corners, rows, columns):
    """(3, rows, columns): exact for coordinates on a coarse dyadic lattice."""
    x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    after = np.roll(corners, -1, axis=0)
    return np.array(
        [
            (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
            for a, b in zip(corners, after, strict=True)
        ]
    )


eighths = st.integers(-40, 200).map(lambda value: value / 8)
triangle = st.lists(st.tuples(eighths, eighths), min_size=3, max_size=3)


@settings(max_examples=150, deadline=None)
@given(triangle)
def test_matches_exact_edge_functions(corners):
    values = edge_functions(np.array(corners), 17, 19)
    inside = (values > 0).all(axis=0) | (values < 0).all(axis=0)
    outside = (values > 0).any(axis=0) & (values < 0).any(axis=0)
    mask = draw([corners], 17, 19)
    assert mask[inside].all()
    assert not mask[outside].any()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 15), st.integers(0, 15)), min_size=4, max_size=30))
def test_triangles_that_share_edges_cover_each_centre_once(places):
    # Corners on pixel centres: every rule about ties is at work.
    points = np.unique(np.array(places), axis=0) + 0.5
    if np.linalg.matrix_rank(points - points[0]) < 2:
        return
    corners = points[Delaunay(points).simplices]
    times = sum(draw([one], 16, 16).astype(int) for one in corners)
    assert times.max() <= 1
    x, y = np.meshgrid(np.arange(16) + 0.5, np.arange(16) + 0.5)
    inner = contains_xy(MultiPoint(points).convex_hull.buffer(-1e-6), x, y)
    assert times[inner].all()
    assert (draw(corners, 16, 16) == (times == 1)).all()


@pytest.mark.parametrize("side", [1, 5, 63, 64, 65, 130])
def test_square_on_whole_pixels_has_its_own_area(side):
    a, b = 3.0, 3.0 + side
    square = [[(a, a), (b, a), (b, b)], [(a, a), (b, b), (a, b)]]
    mask = draw(square, 140, 140)
    assert mask.sum() == side * side
    assert mask[3 : 3 + side, 3 : 3 + side].all()


def test_edge_on_triangle_covers_nothing():
    # A zero-area projection through pixel centres: a half-open span is empty.
    assert draw([[(0.5, 0.5), (5.5, 5.5), (9.5, 9.5)]], 12, 12).sum() == 0
    assert draw([[(0.5, 4.5), (5.5, 4.5), (9.5, 4.5)]], 12, 12).sum() == 0


@settings(max_examples=40, deadline=None)
@given(st.lists(triangle, min_size=1, max_size=6), st.randoms(use_true_random=False))
def test_order_winding_and_duplicates_do_not_matter(soup, random):
    changed = [random.sample(one, 3) for one in soup] + soup[:1]
    random.shuffle(changed)
    assert (draw(soup, 20, 20) == draw(changed, 20, 20)).all()


@settings(max_examples=40, deadline=None)
@given(st.lists(triangle, min_size=1, max_size=4))
def test_clipping_is_cropping(soup):
    # Off the eighths, where an edge may run through pixel centres: there rounding decides, and it
    # differs between places (a sliver along the diagonal once showed it).
    soup = np.array(soup) * 1.0123 + (0.0371, 0.0219)
    assert (draw(soup + 10.0, 40, 40)[10:30, 10:22] == draw(soup, 20, 12)).all()


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1), st.integers(60, 200), st.sampled_from([0.3, 2.0, 20.0, 300.0]),
    st.sampled_from([40, 130]),
)  # fmt: skip
def test_many_at_once_are_drawn_as_one_by_one(seed, count, size, side):
    """64 triangles are looked at together, and many rows of a tall one."""
    rng = np.random.default_rng(seed)
    soup = rng.uniform(-10.0, side + 10.0, (count, 1, 2)) + rng.normal(size=(count, 3, 2)) * size
    alone = [draw([corners], side, side) for corners in soup]
    assert np.array_equal(draw(soup, side, side), np.any(alone, axis=0))
    # A tall one is drawn as in strips of a few rows.
    strips = [draw(soup - [0.0, first], min(8, side - first), side) for first in range(0, side, 8)]
    assert np.array_equal(np.concatenate(strips), np.any(alone, axis=0))


def test_far_triangle_fills_the_image():
    mask = draw([[(-1e30, -1e30), (1e31, -1e30), (-1e30, 1e31)]], 9, 130)
    assert mask.all()


def test_bits_past_the_last_column_are_zero():
    points = np.array([[-9.0, -9, 0], [500, -9, 0], [-9, 500, 0]])
    masks = coverage_masks(points, np.array([[0, 1, 2]], np.int32), FLAT, 4, 70)
    assert masks.shape == (1, 4, 2)
    assert (masks[0, :, 1] == (1 << 6) - 1).all()
    assert (masks[0, :, 0] == ~np.uint64(0)).all()


@pytest.mark.parametrize("subdivisions", [2, 5])
def test_closed_sphere_has_no_pinholes(subdivisions):
    sphere = trimesh.creation.icosphere(subdivisions)
    axes = image_axes(random_directions(12, 3))
    size = 100
    projections = np.concatenate([axes[:, :2] * 48.0, np.full((12, 2, 1), 50.0)], axis=2)
    masks = unpack_masks(
        coverage_masks(sphere.vertices, sphere.faces, projections, size, size), size
    )
    x, y = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
    for mask, frame in zip(masks, axes, strict=True):
        hull = MultiPoint(sphere.vertices @ frame[:2].T * 48.0 + 50.0).convex_hull
        assert mask[contains_xy(hull.buffer(-1e-9), x, y)].all()
        assert not mask[~contains_xy(hull.buffer(1e-9), x, y)].any()


def test_same_masks_on_any_number_of_threads(monkeypatch):
    sphere = trimesh.creation.icosphere(3)
    axes = image_axes(random_directions(33, 1))
    projections = np.concatenate([axes[:, :2] * 30.0, np.full((33, 2, 1), 32.0)], axis=2)
    results = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(coverage_masks(sphere.vertices, sphere.faces, projections, 64, 64))
    assert results[0].shape == (33, 64, 1)
    assert (results[0] == results[1]).all()


def test_no_face_covers_nothing():
    assert coverage_masks(np.zeros((0, 3)), np.zeros((0, 3), np.int32), FLAT, 3, 3).sum() == 0


@pytest.mark.parametrize(
    ("vertices", "faces", "projections", "rows"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], FLAT, 4),
        (np.zeros((3, 3)), [[0, 1]], FLAT, 4),
        (np.zeros((3, 3)), [[0, 1, 3]], FLAT, 4),
        (np.zeros((3, 3)), [[0, 1, -1]], FLAT, 4),
        (np.zeros((3, 3)), [[0, 1, 2]], FLAT[0], 4),
        (np.zeros((3, 3)), [[0, 1, 2]], FLAT, 0),
        (np.zeros((3, 3)), [[0, 1, 2]], FLAT, 65536),
        (np.full((3, 3), np.nan), [[0, 1, 2]], FLAT, 4),
        (np.full((3, 3), -np.inf), [[0, 1, 2]], FLAT, 4),
        (np.full((3, 3), 1e200), [[0, 1, 2]], FLAT, 4),  # its crossings would be NaN
    ],
)
def test_refuses_what_it_cannot_draw(vertices, faces, projections, rows):
    with pytest.raises(ValueError):
        coverage_masks(vertices, np.array(faces, np.int32), projections, rows, 4)
