"""An occluder of a soup: welded, without triangles of no area and without repeats."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.occluder import Occluder

QUAD = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)


def test_equal_corners_become_one_vertex():
    made = Occluder.of(QUAD, 0.5, {"cut": 1.0})
    assert len(made.vertices) == 4
    assert np.array_equal(made.vertices[made.faces], QUAD)
    assert (made.error_bound, dict(made.timings)) == (0.5, {"cut": 1.0})


def test_nothing():
    made = Occluder.of(np.empty((0, 3, 3)), 0.0, {})
    assert made.vertices.shape == (0, 3)
    assert made.faces.shape == (0, 3)


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e90])
def test_no_area_and_repeats_are_left_out(scale):
    line, point = QUAD[:1].copy(), QUAD[:1].copy()
    line[0, 2] = [0.5, 0.0, 0.0]
    point[0] = 3.0
    turned = QUAD[:1, [1, 2, 0]]
    mirrored = QUAD[1:, ::-1]
    made = Occluder.of(np.concatenate([QUAD, line, point, turned, mirrored]) * scale, 0.0, {})
    assert np.array_equal(made.vertices[made.faces], QUAD * scale)


@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_every_other_triangle_stays_in_order(seed, count):
    soup = np.random.default_rng(seed).integers(0, 4, (count, 3, 3)).astype(float)
    made = Occluder.of(soup, 0.0, {})
    seen, expected = set(), []
    for triangle in soup:
        key = tuple(sorted(map(tuple, triangle.tolist())))
        if key not in seen and np.cross(*(triangle[1:] - triangle[0])).any():
            seen.add(key)
            expected.append(triangle)
    assert np.array_equal(made.vertices[made.faces], np.reshape(expected, (-1, 3, 3)))
