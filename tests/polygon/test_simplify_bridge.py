"""Bridged rings: weakly simple, with the area of the polygon."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.section import Polygon, signed_area
from simplifier.polygon.chain import triangulate
from simplifier.polygon.simplify import bridge_holes
from tests.polygon.checks import assert_triangulated
from tests.polygon.corpus import (
    POLYGONS,
    box,
    loop,
    random_star,
    simplified_blobs,
    square,
    variants,
)

ALL = [
    pytest.param(changed, id=f"{name}, {change}")
    for name, polygon in POLYGONS.items()
    for change, changed in variants(polygon, cluttered=False)
]


def edges(points: np.ndarray) -> list[tuple]:
    return list(zip(map(tuple, points), map(tuple, np.roll(points, -1, axis=0)), strict=True))


def bridges(polygon: Polygon, ring: np.ndarray) -> list[tuple]:
    """The segments, as pairs of points, that the ring runs along once in each direction."""
    own = {edge for points in (polygon.outer, *polygon.holes) for edge in edges(points)}
    added = [edge for edge in edges(ring) if edge not in own]
    assert len(set(added)) == len(added)
    assert {(b, a) for a, b in added} == set(added)
    return sorted(edge for edge in added if edge[0] < edge[1])


def assert_bridged(polygon: Polygon) -> None:
    ring = bridge_holes(polygon)
    loops = (polygon.outer, *polygon.holes)
    assert len(ring) == sum(map(len, loops)) + 2 * len(polygon.holes)
    assert signed_area(ring) == pytest.approx(polygon.area, rel=1e-12, abs=1e-12)
    assert {tuple(p) for p in ring} == {tuple(p) for points in loops for p in points}
    segments = shapely.MultiLineString(bridges(polygon, ring))
    assert len(segments.geoms) == len(polygon.holes)
    assert segments.is_simple  # bridges meet each other at ends only
    shape = shapely.Polygon(polygon.outer, polygon.holes)
    assert segments.difference(shape.buffer(1e-9)).is_empty
    # They meet the loops at their ends only: nothing of the loops lies on what is in between.
    for a, b in map(np.array, bridges(polygon, ring)):
        trimmed = 1e-6 * (b - a) / np.hypot(*(b - a))
        assert not shapely.LineString([a + trimmed, b - trimmed]).intersects(shape.boundary)
    assert_triangulated(ring, triangulate(ring), shape)


@pytest.mark.parametrize("polygon", ALL)
def test_corpus(polygon):
    assert_bridged(polygon)


@given(st.integers(0, 2**32 - 1), st.integers(9, 60), st.integers(1, 16))
@settings(max_examples=120, deadline=None)
def test_stars(seed, count, holes):
    assert_bridged(random_star(seed, count, holes))


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.5, 1.0]))
@settings(max_examples=60, deadline=None)
def test_masks(seed, tolerance):
    for polygon in simplified_blobs(seed, tolerance):
        assert_bridged(polygon)


def test_without_holes_the_ring_is_the_outer_loop():
    outer = box(3, 2)
    assert bridge_holes(Polygon(outer)) is outer


def test_a_vertex_in_between_takes_the_bridge():
    hole = square(2, 4, 1)
    free = Polygon(box(10, 10), (hole,))
    assert bridges(free, bridge_holes(free)) == [((3.0, 4.0), (10.0, 10.0))]
    notched = loop((0, 0), (10, 0), (10, 10), (7, 10), (7, 5.5), (6, 10), (0, 10))
    hidden = Polygon(notched, (hole,))
    assert bridges(hidden, bridge_holes(hidden)) == [((3.0, 4.0), (7.0, 5.5))]
    assert_bridged(hidden)


def test_many_holes_share_one_visible_vertex():
    outer = loop((0, 0), (6, 0), (20, 5), (6, 10), (0, 10))
    holes = tuple(square(1 + 0.2 * i, 1 + 1.6 * i, 0.8) for i in range(5))
    assert_bridged(Polygon(outer, holes))
