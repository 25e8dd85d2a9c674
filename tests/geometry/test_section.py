"""Loops, polygons and chains: areas against shapely, levels by their definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon as ShapelyPolygon

from simplifier.geometry.section import Chain, Plane, Polygon, signed_area
from simplifier.geometry.views import image_axes, random_directions

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def star(seed, corners):
    generator = np.random.default_rng(seed)
    angle = (np.arange(corners) + generator.uniform(0.3, 0.7, corners)) * 2 * np.pi / corners
    radius = generator.uniform(1.0, 9.0, corners)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 40), st.floats(-1e6, 1e6))
def test_signed_area_far_from_the_origin(seed, corners, offset):
    loop = star(seed, corners)
    area = ShapelyPolygon(loop).area
    assert signed_area(loop + offset) == pytest.approx(area, rel=1e-7)
    assert signed_area(loop[::-1] + offset) == pytest.approx(-area, rel=1e-7)


def test_area_less_holes():
    hole = np.array([[1.0, 1.0], [1.0, 2.0], [3.0, 2.0], [3.0, 1.0]])
    assert Polygon(SQUARE).area == 16.0
    assert Polygon(SQUARE, (hole,)).area == 14.0
    assert Polygon(SQUARE, (hole, hole + np.array([0.0, 1.5]))).area == 12.0


def test_chain_levels():
    lowest = np.array([2, 1, 3, 1, 1], dtype=np.int32)
    chain = Chain(Plane(np.eye(3), 1.0), np.arange(10.0).reshape(5, 2), lowest)
    assert chain.triangles == 3
    assert chain.at(3).tolist() == chain.ring.tolist()
    assert chain.at(2)[:, 0].tolist() == [0, 2, 6, 8]
    assert chain.at(1)[:, 0].tolist() == [2, 6, 8]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-50.0, 50.0))
def test_planes_keep_lengths_and_depth(seed, depth):
    axes = image_axes(random_directions(1, seed))[0]
    points = np.random.default_rng(seed).normal(size=(20, 2)) * 30.0
    shown = Plane(axes, depth).to_space(points)
    assert shown @ axes[2] == pytest.approx(depth, abs=1e-9)
    assert np.stack([shown @ axes[0], shown @ axes[1]], axis=1) == pytest.approx(points, abs=1e-9)
