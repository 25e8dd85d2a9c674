"""Polygons drawn by exclusive or, against the even-odd rule at each pixel centre."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path as Outline
from shapely import Polygon as ShapelyPolygon
from shapely import contains_xy
from shapely.geometry import box as rectangle

from simplifier.geometry.section import Polygon
from simplifier.kernels.measure import (
    draw_polygon,
    gather_ring,
    score_images,
    score_polygon_unions,
)
from simplifier.polygon.simplify import bridge_holes
from tests.kernels.bits import SIDE, blob, packed, unpacked

PIXELS = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
"""The map that takes plane coordinates for pixels."""

TO_THE_MIDDLE = np.array([0.0, 0.0, 32.0, 0.0, 0.0, 32.0])
"""What a map adds to show its origin in the middle of the image."""

CENTRES = np.stack(np.meshgrid(np.arange(SIDE) + 0.5, np.arange(SIDE) + 0.5), axis=-1)


def end_to_end(rings, lowests=None):
    """``points``, ``lowest`` and ``offsets`` of the kernels."""
    lowests = lowests or [np.zeros(len(ring)) for ring in rings]
    offsets = np.cumsum([0] + [len(ring) for ring in rings]).astype(np.int64)
    points = np.ascontiguousarray(np.concatenate(rings), dtype=np.float64)
    return points, np.concatenate(lowests).astype(np.int32), offsets


def draw(ring, pixel_map=PIXELS):
    images = np.zeros((1, SIDE), dtype=np.uint64)
    maps = np.array(pixel_map, dtype=np.float64).reshape(1, 1, 6)
    draw_polygon(*end_to_end([ring]), maps, 0, 1, images)
    return unpacked(images[0])


def mapped(ring, m):
    return np.asarray(ring) @ np.array([[m[0], m[3]], [m[1], m[4]]]) + [m[2], m[5]]


def even_odd(ring):
    """(64, 64) bool: pixel centres with an odd number of edges on their left; half-open rows."""
    x, y = CENTRES[..., 0], CENTRES[..., 1]
    crossings = np.zeros((SIDE, SIDE), dtype=np.int64)
    for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        passed = (y0 <= y) != (y1 <= y)
        if passed.any():
            crossings += passed & (x0 + (y - y0) / (y1 - y0) * (x1 - x0) <= x)
    return crossings % 2 == 1


def near_the_edge(ring, distance=1e-6):
    closed = np.concatenate([ring, ring[:1]])
    line = ShapelyPolygon(closed).exterior.buffer(distance)
    return contains_xy(line, CENTRES[..., 0], CENTRES[..., 1])


def star(seed, corners, reach=40.0, centre=(32.0, 32.0)):
    """A simple polygon: radii at random around a centre, no gap of half a turn."""
    generator = np.random.default_rng(seed)
    angle = (np.arange(corners) + generator.uniform(0.3, 0.7, corners)) * 2.0 * np.pi / corners
    radius = generator.uniform(0.1, 1.0, corners) * reach
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) + centre


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(3, 40), st.floats(1.0, 90.0), st.floats(-20.0, 90.0), st.floats(-20, 90))
def test_simple_polygons_match_shapely(seed, corners, reach, x, y):
    ring = star(seed, corners, reach, (x, y))
    expected = contains_xy(ShapelyPolygon(ring), CENTRES[..., 0], CENTRES[..., 1])
    differ = draw(ring) != expected
    assert not (differ & ~near_the_edge(ring)).any()


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(3, 30), st.floats(10.0, 300.0))
def test_rings_that_cross_themselves_match_matplotlib(seed, corners, spread):
    ring = np.random.default_rng(seed).normal(32.0, spread / 3.0, (corners, 2))
    closed = np.concatenate([ring, ring[:1]])
    inside = Outline(closed).contains_points(CENTRES.reshape(-1, 2)).reshape(SIDE, SIDE)
    # Matplotlib's rule is even-odd too; no centre lies on a random edge.
    assert np.array_equal(draw(ring), inside)


on_the_lattice = st.lists(
    st.tuples(st.integers(-20, 148), st.integers(-20, 148)), min_size=3, max_size=12
)


@settings(max_examples=120, deadline=None)
@given(on_the_lattice)
def test_ties_go_to_the_half_open_side(places):
    # Corners on multiples of half a pixel, so many edges pass through centres exactly.
    ring = np.array(places, dtype=np.float64) / 2.0
    differ = draw(ring) != even_odd(ring)
    on_a_slope = near_the_edge(ring + 1e-9)
    assert not (differ & ~on_a_slope).any()
    rows = even_odd(ring).sum(axis=1)
    assert np.abs(draw(ring).sum(axis=1) - rows).max() <= len(ring)


@pytest.mark.parametrize("shift", [0.0, 0.5, 0.25])
def test_a_rectangle_covers_its_area(shift):
    ring = np.array([[10, 20], [30, 20], [30, 50], [10, 50]]) + shift
    assert draw(ring).sum() == 20 * 30


def test_tiles_cover_each_centre_once():
    # Triangles around a centre, every corner on a pixel centre: all rules about ties at work.
    outer = np.array([[5, 5], [60, 5], [60, 33], [60, 60], [22, 60], [5, 60]]) + 0.5
    middle = np.array([31.5, 28.5])
    count = sum(
        draw(np.array([middle, a, b])).astype(int)
        for a, b in zip(outer, np.roll(outer, -1, axis=0), strict=True)
    )
    assert np.array_equal(count, draw(outer))


def test_winding_and_start_do_not_matter():
    ring = star(4, 17)
    assert np.array_equal(draw(ring[::-1]), draw(ring))
    assert np.array_equal(draw(np.roll(ring, 5, axis=0)), draw(ring))


def holes(count, seed):
    """Squares in the cells of a 3 x 3 pattern, clockwise, and shapely's outer less the squares."""
    generator = np.random.default_rng(seed)
    outer = np.array([[2.3, 2.7], [61.2, 3.4], [60.6, 61.9], [3.1, 60.2]])
    loops = []
    for cell in generator.permutation(9)[:count]:
        x, y = 8.0 + 17.0 * (cell % 3), 8.0 + 17.0 * (cell // 3)
        low, high = generator.uniform(0.0, 5.0, 2), generator.uniform(6.0, 13.0, 2)
        corners = rectangle(*low, *high).exterior.coords[:4]
        loops.append(np.array(corners) + np.array([x, y]))
    loops = [loop if _clockwise(loop) else loop[::-1].copy() for loop in loops]
    return outer, loops


def _clockwise(loop):
    return ShapelyPolygon(loop).exterior.is_ccw is False


@settings(max_examples=25, deadline=None)
@given(seeds, st.integers(1, 9))
def test_bridges_leave_no_trace(seed, count):
    outer, loops = holes(count, seed)
    ring = bridge_holes(Polygon(outer, tuple(loops)))
    expected = contains_xy(ShapelyPolygon(outer, loops), CENTRES[..., 0], CENTRES[..., 1])
    assert len(ring) == 4 + 6 * count
    assert np.array_equal(draw(ring), expected)


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(3, 20))
def test_any_affine_map(seed, corners):
    generator = np.random.default_rng(seed)
    ring = star(seed, corners, 1.0, (0.0, 0.0))
    m = generator.normal(0.0, 25.0, 6) + TO_THE_MIDDLE
    differ = draw(ring, m) != even_odd(mapped(ring, m))
    assert not (differ & ~near_the_edge(mapped(ring, m))).any()


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(3, 20), st.floats(-90.0, 90.0))
def test_edge_on_polygons_cover_next_to_nothing(seed, corners, angle):
    # Seen edge on, both coordinates are multiples of one: a line, drawn forth and back.
    ring = star(seed, corners, 1.0, (0.0, 0.0))
    a, b = np.random.default_rng(seed).normal(0.0, 25.0, 2)
    x, y = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    image = draw(ring, [a * x, b * x, 32.0, a * y, b * y, 32.0])
    line = mapped(ring, [a * x, b * x, 32.0, a * y, b * y, 32.0])
    assert not (image & ~near_the_edge(line)).any()


@pytest.mark.parametrize("angle", [0.0, 90.0])
def test_edge_on_along_the_pixels_covers_nothing(angle):
    x, y = float(angle == 0.0), float(angle == 90.0)
    assert not draw(star(3, 12, 1.0, (0.0, 0.0)), [30 * x, 9 * x, 32, 30 * y, 9 * y, 32]).any()


@pytest.mark.parametrize(
    ("low", "high"),
    [((-50, -50), (-1, 200)), ((70, -9), (90, 80)), ((-9, 64.6), (80, 99)), ((-9, -30), (80, 0.2))],
)
def test_wholly_outside(low, high):
    assert not draw(np.array(rectangle(*low, *high).exterior.coords)[:4]).any()


@pytest.mark.parametrize("reach", [64.0, 1e3, 1e6, 1e9])
def test_partly_outside(reach):
    mask = draw(np.array([[-reach, 10.2], [20.2, 10.2], [20.2, reach + 64], [-reach, reach + 64]]))
    expected = (CENTRES[..., 0] < 20.2) & (CENTRES[..., 1] > 10.2)
    assert np.array_equal(mask, expected)


def test_around_the_whole_image():
    assert draw(np.array([[-1e5, -1e5], [1e5, -1e5], [0.0, 1e6]])).all()


def test_edges_level_but_for_rounding_stay_between_their_ends():
    # A level edge after a rotation: it passes a row of centres within its last bits.
    generator = np.random.default_rng(0)
    for row in generator.integers(3, 50, 300):
        left, right = np.sort(generator.uniform(5.0, 59.0, 2))
        low = row + 0.5 + generator.integers(-3, 4, 2) * np.spacing(row + 0.5)
        mask = draw(np.array([[left, low[0]], [right, low[1]], [right, row + 8], [left, row + 8]]))
        assert not mask[:, (CENTRES[0, :, 0] < left) | (CENTRES[0, :, 0] > right)].any()


@settings(max_examples=40, deadline=None)
@given(seeds, st.integers(3, 40), st.integers(1, 40))
def test_levels_keep_the_vertices_that_are_still_there(seed, corners, level):
    lowest = np.random.default_rng(seed).integers(0, 40, corners).astype(np.int32)
    ring, room = star(seed, corners), np.empty((corners, 2))
    count = gather_ring(ring, lowest, 0, corners, level, room)
    assert np.array_equal(room[:count], ring[lowest <= level])


@settings(max_examples=15, deadline=None)
@given(seeds, st.integers(1, 9), st.integers(1, 5))
def test_scores_of_unions(seed, count, views):
    """Each score is that of the base and the one polygon, drawn and united by hand."""
    generator = np.random.default_rng(seed)
    rings = [star(seed + i, generator.integers(3, 12), 1.0, (0.0, 0.0)) for i in range(4)]
    lowests = [generator.integers(0, 3, len(ring)) for ring in rings]
    shapes = end_to_end(rings, lowests)
    maps = generator.normal(0.0, 20.0, (4, views, 6)) + TO_THE_MIDDLE
    base = np.stack([packed(blob(seed % 1000 + view, 0.2)) for view in range(views)])
    polygons = generator.integers(0, 4, count).astype(np.int32)
    levels = generator.integers(2, 4, count).astype(np.int32)
    scores = np.zeros(count, dtype=np.int64)
    score_polygon_unions(*shapes, maps, polygons, levels, base, 0, count, scores)
    for polygon, level, score in zip(polygons, levels, scores, strict=True):
        images = np.zeros_like(base)
        draw_polygon(*shapes, maps, polygon, level, images)
        ring = rings[polygon][lowests[polygon] <= level]
        for view in range(views):
            differ = unpacked(images[view]) != even_odd(mapped(ring, maps[polygon, view]))
            assert differ.sum() <= len(ring)
        assert score == score_images(images | base)


def test_scores_of_a_part_of_the_list_leave_the_rest_alone():
    shapes, maps = end_to_end([star(1, 9)]), PIXELS.reshape(1, 1, 6)
    polygons, levels = np.zeros(5, dtype=np.int32), np.ones(5, dtype=np.int32)
    scores = np.full(5, -7, dtype=np.int64)
    score_polygon_unions(
        *shapes, maps, polygons, levels, np.zeros((1, 64), np.uint64), 1, 3, scores
    )
    assert (scores[[0, 3, 4]] == -7).all()
    assert scores[1] == scores[2] == score_images(packed(draw(star(1, 9)))[None])
