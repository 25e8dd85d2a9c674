"""Pixels before which something stands, against a ray a pixel."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.kernels.front import depth_limits, front_pixels, pixels_before
from tests import solids

FLAT = np.eye(3, 4)[None]
"""One view that takes x and y for pixel coordinates and z for the depth."""

NOTHING = np.zeros((0, 3)), np.zeros((0, 3), np.int32)


def soup(corners):
    """Vertices and faces of triangles (m, 3, 3)."""
    points = np.asarray(corners, dtype=np.float64).reshape(-1, 3)
    return points, np.arange(len(points), dtype=np.int32).reshape(-1, 3)


def square(low, high, depth, far=None):
    """From (low, low) to (high, high), at ``far`` where x is high."""
    far = depth if far is None else far
    a, b = (low, low, depth), (high, low, far)
    c, d = (high, high, far), (low, high, depth)
    return [(a, b, c), (a, c, d)]


def counted(mesh, occluder, image=16, threshold=0.25, projections=FLAT):
    return front_pixels(soup(mesh), soup(occluder), projections, image, threshold)


def depths_along_rays(corners, image):
    """((image, image) nearest depth, infinite where there is none; where a ray meets an edge)."""
    x, y = np.meshgrid(np.arange(image) + 0.5, np.arange(image) + 0.5)
    nearest, doubt = np.full(x.shape, np.inf), np.zeros(x.shape, dtype=bool)
    for (ax, ay, az), (bx, by, bz), (cx, cy, cz) in corners:
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        of_b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
        of_c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
        least = np.minimum(np.minimum(of_b, of_c), 1.0 - of_b - of_c)
        depth = az + of_b * (bz - az) + of_c * (cz - az)
        nearest = np.where(least >= 0.0, np.minimum(nearest, depth), nearest)
        doubt |= np.abs(least) < 1e-9
    return nearest, doubt


@settings(deadline=None)
@given(st.integers(0, 12), st.integers(0, 6), st.integers(1, 70), st.integers(0, 2**32 - 1))
def test_random_soups(triangles, others, image, seed):
    random = np.random.default_rng(seed)
    size = np.array([image, image, 4.0])
    mesh = random.uniform(-0.3, 1.3, (triangles, 3, 3)) * size
    occluder = random.uniform(-0.3, 1.3, (others, 3, 3)) * size
    (own, doubt), (other, unsure) = (depths_along_rays(one, image) for one in (mesh, occluder))
    seen = np.isfinite(own)
    behind = np.full(own.shape, -np.inf)
    np.subtract(own, other, out=behind, where=seen & np.isfinite(other))
    doubt |= unsure | (np.abs(behind - 0.5) < 1e-9)
    ((there, before),) = counted(mesh, occluder, image, 0.5)
    front = behind > 0.5
    assert (seen & ~doubt).sum() <= there <= (seen | doubt).sum()
    assert (front & ~doubt).sum() <= before <= (front | doubt).sum()


@pytest.mark.parametrize(
    ("depth", "before"),
    [(1.0, 0), (1.25, 0), (np.nextafter(1.25, 2.0), 100), (2.0, 100), (-2.0, 0)],
)
def test_only_beyond_the_threshold_is_behind(depth, before):
    mesh, occluder = square(2, 12, depth), square(1, 13, 1.0)
    assert counted(mesh, occluder).tolist() == [[100, before]]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("last_first", [False, True])
def test_of_several_layers_the_nearest_counts_in_any_order(turned, last_first):
    mesh = [*square(0, 16, 9.0), *square(0, 8, 2.0)]
    occluder = [*square(0, 16, 8.9), *square(4, 12, 1.0), *square(4, 6, 1.9)]
    if turned:
        mesh, occluder = ([one[::-1] for one in many] for many in (mesh, occluder))
    if last_first:
        mesh, occluder = mesh[::-1], occluder[::-1]
    # Behind 4..12 by more than a quarter: all but nothing; the near square there is, too.
    assert counted(mesh, occluder).tolist() == [[256, 64]]


def test_a_surface_at_the_occluder_settles_whatever_lies_behind_it():
    layers = [*square(0, 16, 9.0), *square(0, 16, 1.0), *square(0, 16, 5.0)]
    for mesh in (layers, layers[::-1]):
        assert counted(mesh, square(0, 16, 1.0)).tolist() == [[256, 0]]


@pytest.mark.parametrize(("slope", "columns"), [(1.0, 15), (0.5, 15), (0.125, 13), (1 / 64, 0)])
def test_a_slope_crosses_the_threshold_where_it_does(slope, columns):
    """At column c it lies (c + 0.5) times the slope behind: over a quarter from there on."""
    mesh = square(0, 16, 0.0, 16 * slope)
    expected = sum((column + 0.5) * slope > 0.25 for column in range(16))
    assert counted(mesh, square(0, 16, 0.0)).tolist() == [[256, 16 * expected]]
    steep = square(0, 16, 0.0, -16 * slope)
    assert counted(square(0, 16, 0.0), steep).tolist() == [[256, 16 * expected]]


@pytest.mark.parametrize("side", [1, 5, 63, 64, 65, 130])
def test_squares_of_any_number_of_words(side):
    mesh, occluder = square(3, 3 + side, 1.0), square(2, 3 + side // 2, 0.0)
    assert counted(mesh, occluder, 140).tolist() == [[side**2, (side // 2) ** 2]]
    assert counted(mesh, square(3, 4 + side // 2, 0.0), 140)[0, 1] == (side // 2 + 1) ** 2


def test_beside_the_mesh_nothing_counts():
    assert counted(square(8, 16, 5.0), square(0, 8, 0.0)).tolist() == [[64, 0]]


def test_what_falls_outside_is_clipped():
    mesh, occluder = square(-1e6, 1e7, 5.0), square(-1e9, 8, 0.0)
    assert counted(mesh, occluder).tolist() == [[256, 64]]


def test_empty_pictures_and_occluders():
    mesh = square(0, 16, 5.0)
    assert front_pixels(soup(mesh), NOTHING, FLAT, 16, 0.25).tolist() == [[256, 0]]
    assert front_pixels(NOTHING, soup(mesh), FLAT, 16, 0.25).tolist() == [[0, 0]]
    assert counted(square(20, 30, 5.0), square(0, 40, 0.0)).tolist() == [[0, 0]]
    assert front_pixels(soup(mesh), NOTHING, FLAT[:0], 16, 0.25).shape == (0, 2)


def test_triangles_without_area_add_nothing():
    edge_on = [
        [(0.5, 0.5, 0.0), (5.5, 5.5, 0.0), (9.5, 9.5, 0.0)],
        [(0.5, 4.5, 0.0), (5.5, 4.5, 0.0), (9.5, 4.5, 0.0)],
        [(4.5, 4.5, 0.0)] * 3,
    ]
    assert counted(edge_on, square(0, 16, 0.0)).tolist() == [[0, 0]]
    assert counted(square(0, 16, 1.0), edge_on).tolist() == [[256, 0]]
    # Nor do they settle what lies behind them.
    assert counted([*edge_on, *square(0, 16, 1.0)], square(0, 16, 0.0)).tolist() == [[256, 256]]


@pytest.mark.parametrize("width", [1e-300, 1e-13, 1e-8, 1e-3])
def test_the_depth_of_a_sliver_is_between_its_corners(width):
    """It leans so far that its plane says nothing; rounding may take it for either end."""
    sliver = [[(0.5, 0.0, 1.0), (0.5 + width, 0.0, 2.0), (0.5, 9.0, 1.0)]]
    there, before = counted(sliver, square(0, 16, 1.0))[0]
    assert (there, before) == (9, 0) or width < 1e-15
    assert counted(sliver, square(0, 16, 0.5))[0, 1] == there
    assert counted(sliver, square(0, 16, 1.8)).tolist() == [[there, 0]]


shifts = st.lists(st.integers(0, 40).map(lambda value: value / 8), min_size=2, max_size=4)


@settings(deadline=None)
@given(shifts, st.integers(0, 2**32 - 1))
def test_an_occluder_further_away_stands_before_no_more(by, seed):
    random = np.random.default_rng(seed)
    mesh = random.uniform(0.0, 16.0, (8, 3, 3))
    occluder = random.uniform(0.0, 16.0, (4, 3, 3))
    fronts = [counted(mesh, np.add(occluder, (0, 0, shift)))[0, 1] for shift in sorted(by)]
    assert fronts == sorted(fronts, reverse=True)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_more_of_either_never_lowers_its_own_figure(seed):
    """More of the mesh covers no less; more of an occluder stands before no less."""
    random = np.random.default_rng(seed)
    mesh, occluder = random.uniform(0.0, 16.0, (8, 3, 3)), random.uniform(0.0, 16.0, (4, 3, 3))
    there, before = counted(mesh, occluder)[0]
    assert counted(mesh[:5], occluder)[0, 0] <= there
    assert counted(mesh, occluder[:2])[0, 1] <= before <= there


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_way_of_winding_changes_nothing(mirrored):
    """Whatever side of a mesh is drawn first; of one that overlaps itself, too."""
    ball = solids.moved(solids.sphere(rings=9), 30.0, (34.0, 33.0, 40.0))
    block = solids.moved(solids.box(), 25.0, (40.0, 40.0, 20.0))
    mesh = np.concatenate([ball.vertices[ball.faces], block.vertices[block.faces]] * 2)
    around = solids.moved(solids.sphere(rings=4), 32.0, (34.0, 33.0, 40.0))
    occluder = around.vertices[around.faces]
    views = np.eye(3, 4)[None] * np.where(mirrored, [[1.0], [1.0], [-1.0]], 1.0)
    found = counted(mesh, occluder, 80, 1.0, views)
    assert 0 < found[0, 1] < found[0, 0]
    for other in (mesh[:, ::-1], mesh[::-1], mesh[1::2].tolist() + mesh[::2, ::-1].tolist()):
        np.testing.assert_array_equal(counted(other, occluder, 80, 1.0, views), found)


def test_each_view_has_its_own_depth():
    turned, aside = np.diag([1.0, 1.0, -1.0]) @ FLAT, np.add(FLAT, [0.0, 0.0, 0.0, 8.0])
    away = np.concatenate([FLAT, turned, aside])
    found = counted(square(0, 16, 2.0), square(0, 16, 1.0), projections=away)
    assert found.tolist() == [[256, 256], [256, 0], [64, 64]]


def test_same_counts_on_any_number_of_threads(monkeypatch):
    random = np.random.default_rng(5)
    mesh, occluder = random.uniform(0.0, 16.0, (40, 3, 3)), random.uniform(0.0, 16.0, (9, 3, 3))
    views = np.eye(3, 4) + random.normal(0.0, 0.2, (33, 3, 4))
    results = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(counted(mesh, occluder, projections=views))
    assert np.array_equal(*results)
    assert len(np.unique(results[0][:, 1])) > 5


@pytest.mark.parametrize("wrong", [np.full((3, 3), np.nan), np.full((3, 3), 1e200)])
def test_refuses_what_it_cannot_draw(wrong):
    with pytest.raises(ValueError, match="finite"):
        counted(square(0, 1, 0.0), [wrong])
    with pytest.raises(ValueError, match="finite"):
        counted([wrong], square(0, 1, 0.0))
    with pytest.raises(ValueError, match=r"\(V, 3, 4\)"):
        counted(square(0, 1, 0.0), [], projections=FLAT[:, :2])


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 12), st.integers(0, 6), st.integers(1, 70), st.integers(0, 2**32 - 1))
def test_limits_tell_as_much_as_the_mesh(triangles, others, image, seed):
    """What is known of a mesh once counts the same pixels; single precision may lose one or two."""
    random = np.random.default_rng(seed)
    size = np.array([image, image, 4.0])
    mesh = random.uniform(-0.3, 1.3, (triangles, 3, 3)) * size
    occluder = random.uniform(-0.3, 1.3, (others, 3, 3)) * size
    limits = depth_limits(*soup(mesh), FLAT, image, 0.25)
    found = pixels_before(limits, occluder, FLAT)[0]
    expected = counted(mesh, occluder, image)[0]
    assert found[0] == expected[0] == np.isfinite(limits).sum()
    assert abs(found[1] - expected[1]) <= 2
