"""Simplified polygons: valid, within the tolerance, and no more points than needed."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from simplifier.geometry.section import Polygon, signed_area
from simplifier.kernels.simplify import simplify_loops
from simplifier.polygon.simplify import simplify_polygon
from tests.polygon.checks import region
from tests.polygon.corpus import (
    PINCHED,
    POLYGONS,
    blobs,
    box,
    largest,
    loop,
    maze,
    pieces,
    random_star,
    square,
    star,
    variants,
)

TOLERANCES = st.sampled_from([0.0, 0.3, 0.5, 0.8, 1.0, 2.0, 4.0])
ALL = [
    pytest.param(changed, id=f"{name}, {change}")
    for name, polygon in {**POLYGONS, **PINCHED}.items()
    for change, changed in variants(polygon, cluttered=name not in PINCHED)
]


def assert_promises(polygon: Polygon, tolerance: float) -> Polygon | None:
    result = simplify_polygon(polygon, tolerance)
    if result is None:
        return None
    shape = shapely.Polygon(result.outer, result.holes)
    assert shape.is_valid, shapely.is_valid_reason(shape)
    # Loops do not even touch.
    assert shapely.MultiLineString([shape.exterior, *shape.interiors]).is_simple
    # A buffer's arcs are polygons: 64 segments a quarter circle stay within 1e-4 of the radius.
    around = region(polygon).buffer(tolerance * (1 + 1e-4) + 1e-9, quad_segs=64)
    assert shape.difference(around).area < 1e-9
    assert signed_area(result.outer) > 0
    assert all(signed_area(hole) < 0 for hole in result.holes)
    assert len(result.outer) <= len(polygon.outer)
    assert sum(map(len, result.holes)) <= sum(map(len, polygon.holes))
    return result


def plain_rdp(points: np.ndarray, tolerance: float) -> list[tuple[float, float]]:
    """The textbook recursion between the two anchors, without repair."""
    anchor = distances(points, points[0]).argmax()
    path = np.roll(points, -anchor, axis=0)
    path = np.concatenate([path, path[:1]])
    far = distances(path, path[0]).argmax()

    def between(low: int, high: int) -> list[int]:
        if high - low < 2:
            return []
        chord = shapely.LineString(path[[low, high]])
        apart = shapely.distance(chord, shapely.points(path[low + 1 : high]))
        if apart.max() <= tolerance:
            return []
        split = low + 1 + int(apart.argmax())
        return [*between(low, split), split, *between(split, high)]

    kept = [0, *between(0, far), far, *between(far, len(points))]
    return [tuple(p) for p in path[kept]]


def distances(points: np.ndarray, point: np.ndarray) -> np.ndarray:
    return np.hypot(*(points - point).T)


@pytest.mark.parametrize("polygon", ALL)
@pytest.mark.parametrize("tolerance", [0.0, 1.0])
def test_corpus(polygon, tolerance):
    assert_promises(polygon, tolerance)


# Loops crossed before the repair at these.
@example(14, 1.0)
@example(49, 2.0)
@given(st.integers(0, 2**32 - 1), TOLERANCES)
@settings(max_examples=150, deadline=None)
def test_masks(seed, tolerance):
    for polygon in pieces(blobs(seed)):
        assert_promises(polygon, tolerance)


@given(st.integers(0, 2**32 - 1), st.integers(9, 60), st.integers(0, 8), TOLERANCES)
@settings(max_examples=150, deadline=None)
def test_stars(seed, count, holes, tolerance):
    assert_promises(random_star(seed, count, holes), tolerance)


@given(st.integers(0, 2**32 - 1), TOLERANCES)
@settings(max_examples=20, deadline=None)
def test_mazes(seed, tolerance):
    (polygon,) = pieces(maze(seed, 8))
    assert_promises(polygon, tolerance)


@given(st.integers(0, 2**32 - 1), st.floats(0.01, 5.0))
@settings(max_examples=100, deadline=None)
def test_where_nothing_crosses_it_is_plain_ramer_douglas_peucker(seed, tolerance):
    polygon = random_star(seed, 40, 0)
    plain = plain_rdp(polygon.outer, tolerance)
    result = simplify_polygon(polygon, tolerance)
    if len(plain) < 3:
        assert result is None
    elif shapely.Polygon(plain).is_valid:
        assert [tuple(p) for p in result.outer] == plain
    else:
        assert len(result.outer) > len(plain)


def test_plain_ramer_douglas_peucker_can_cross_itself_and_is_repaired():
    polygon = POLYGONS["hook_that_crosses_itself"]
    plain = plain_rdp(polygon.outer, 2.0)
    assert not shapely.Polygon(plain).is_valid
    result = assert_promises(polygon, 2.0)
    assert result is not None
    assert len(plain) < len(result.outer) < len(polygon.outer)


def test_a_stair_becomes_a_slope():
    steps = [(i + k, i) for i in range(8) for k in (0, 1)]
    polygon = Polygon(loop(*steps, (8, 8), (0, 8)))
    result = assert_promises(polygon, 1.0)
    assert result is not None
    assert len(result.outer) == 3


def test_distance_is_to_the_chord_and_not_to_its_line():
    # The tip at x = 12 is on the line of the chord from (0, 0) to (10, 0) but 2 beyond its end.
    polygon = Polygon(loop((0, 0), (12, -0.1), (10, 0), (10, 9), (0, 14)))
    result = assert_promises(polygon, 1.0)
    assert result is not None
    assert [12.0, -0.1] in result.outer.tolist()


@pytest.mark.parametrize("rows", [("#",), ("##",), ("####",)])
def test_what_is_thinner_than_the_tolerance_collapses(rows):
    assert simplify_polygon(largest(*rows), 1.0) is None


def test_small_holes_are_covered_and_large_ones_kept():
    polygon = Polygon(box(20, 20), (square(2, 2, 1), square(8, 8, 6)))
    result = assert_promises(polygon, 1.0)
    assert result is not None
    assert [-signed_area(hole) for hole in result.holes] == [36.0]


def test_a_hole_of_the_tolerance_squared_is_covered():
    polygon = Polygon(box(9, 9), (loop((2, 2), (2.1, 7), (2.3, 2)),))
    assert len(simplify_polygon(polygon, 0.2).holes) == 1
    assert simplify_polygon(polygon, 0.75).holes == ()


def test_a_hole_passed_over_by_the_outer_loop_is_dropped():
    outer = loop((0, 0), (10, 0), (14, 5), (10, 10), (0, 10))
    hole = loop((10.3, 4.9), (13.4, 5.3), (13.4, 4.7))
    assert shapely.Polygon(outer, [hole]).is_valid
    result = assert_promises(Polygon(outer, (hole,)), 4.5)
    assert result is not None
    assert result.holes == ()


@pytest.mark.parametrize("thickness", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("tolerance", [0.5, 1.0, 3.0])
def test_thin_frames_keep_their_hole_open(thickness, tolerance):
    angle = np.arange(48) * 2.0 * np.pi / 48
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    polygon = Polygon(20.0 * circle, ((20.0 - thickness) * circle[::-1],))
    result = assert_promises(polygon, tolerance)
    assert result is not None
    assert len(result.holes) == 1


@pytest.mark.parametrize("polygon", PINCHED.values(), ids=PINCHED)
def test_touching_corners_are_drawn_into_the_covered_side(polygon):
    result = assert_promises(polygon, 0.0)
    assert result is not None
    assert sum(map(len, (result.outer, *result.holes))) == sum(
        map(len, (polygon.outer, *polygon.holes))
    )
    assert region(polygon).covers(shapely.Polygon(result.outer, result.holes).buffer(-1e-12))
    assert 0.0 < polygon.area - result.area < 0.05


def test_what_does_not_touch_is_not_moved():
    polygon = POLYGONS["square_with_three_holes"]
    result = simplify_polygon(polygon, 0.0)
    for before, after in zip(
        (polygon.outer, *polygon.holes), (result.outer, *result.holes), strict=True
    ):
        assert sorted(before.tolist()) == sorted(after.tolist())


def test_the_input_is_left_alone():
    polygon = PINCHED["pinched_all_over"]
    before = polygon.outer.copy()
    simplify_polygon(polygon, 0.0)
    assert np.array_equal(polygon.outer, before)


def test_scale_and_place_do_not_matter():
    polygon = random_star(4, 50, 5)
    plain = simplify_polygon(polygon, 1.0)
    scaled = simplify_polygon(
        Polygon(polygon.outer * 8.0 + 64.0, tuple(h * 8.0 + 64.0 for h in polygon.holes)), 8.0
    )
    assert len(plain.holes) == len(scaled.holes)
    np.testing.assert_allclose(scaled.outer, plain.outer * 8.0 + 64.0, atol=1e-9)


def test_kernel_takes_what_the_stage_gives_it():
    points, starts = simplify_loops(star(5, 2.0, 6.0), np.array([0, 10]), 0.1)
    assert points.shape == (10, 2)
    assert starts.tolist() == [0, 10]
