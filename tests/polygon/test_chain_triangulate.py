"""Triangulations: counter-clockwise, nothing twice, nothing missing."""

from __future__ import annotations

import mapbox_earcut
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.section import Polygon
from simplifier.polygon.chain import triangulate
from simplifier.polygon.simplify import bridge_holes
from tests.polygon.checks import assert_triangulated, region
from tests.polygon.corpus import PINCHED, POLYGONS, box, loop, random_star, square, variants

ALL = [
    pytest.param(changed, id=f"{name}, {change}")
    for name, polygon in {**POLYGONS, **PINCHED}.items()
    for change, changed in variants(polygon)
]


def assert_covered(polygon: Polygon) -> None:
    ring = bridge_holes(polygon)
    assert_triangulated(ring, triangulate(ring), region(polygon))


@pytest.mark.parametrize("polygon", ALL)
def test_corpus(polygon):
    assert_covered(polygon)


@pytest.mark.parametrize("polygon", ALL)
def test_corpus_without_earcut(polygon, monkeypatch):
    nothing = np.zeros(0, dtype=np.uint32)
    monkeypatch.setattr(mapbox_earcut, "triangulate_float64", lambda ring, ends: nothing)
    assert_covered(polygon)


@given(st.integers(0, 2**32 - 1), st.integers(9, 60), st.integers(0, 16))
@settings(max_examples=100, deadline=None)
def test_stars(seed, count, holes):
    assert_covered(random_star(seed, count, holes))


def test_straight_points_may_be_in_no_triangle():
    ring = loop((0, 0), (1, 0), (2, 0), (2, 2), (0, 2))
    triangles = triangulate(ring)
    assert 2 <= len(triangles) <= 3
    assert_triangulated(ring, triangles, shapely.Polygon(ring))


def test_a_ring_with_one_hole_needs_two_more_triangles_than_vertices():
    ring = bridge_holes(Polygon(box(9, 9), (square(3, 3, 2),)))
    assert len(ring) == 10
    assert len(triangulate(ring)) == 8


def test_wrong_earcut_results_are_replaced(monkeypatch):
    """A fan over a reflex vertex covers too much; the area tells."""
    ring = loop((0, 0), (4, 0), (1, 1), (0, 4))
    fan = np.array([0, 1, 3, 1, 2, 3], dtype=np.uint32)
    monkeypatch.setattr(mapbox_earcut, "triangulate_float64", lambda ring, ends: fan)
    assert_triangulated(ring, triangulate(ring), shapely.Polygon(ring))
