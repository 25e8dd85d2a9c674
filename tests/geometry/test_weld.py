"""Welding: the same triangles of fewer vertices, and the edges that they share."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.weld import edge_pairs, weld


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@given(seed=st.integers(0, 2**32 - 1))
def test_triangles_stay_and_no_two_vertices_are_equal(kind, seed):
    random = np.random.default_rng(seed)
    signs = random.choice([-1.0, 0.0, 1.0], (30, 1))
    vertices = (signs * random.integers(-1, 2, (30, 3))).astype(kind)
    faces = random.integers(0, 30, (random.integers(0, 12), 3))
    welded, corners = weld(vertices, faces)
    assert (welded.dtype, corners.dtype) == (kind, np.int32)
    np.testing.assert_array_equal(welded[corners].reshape(-1, 3), vertices[faces].reshape(-1, 3))
    assert len(np.unique(welded, axis=0)) == len(welded)
    assert corners.reshape(-1).tolist() == _numbered_by_use(corners.reshape(-1).tolist())
    again, same = weld(welded, corners)
    np.testing.assert_array_equal(again, welded)
    np.testing.assert_array_equal(same, corners)


def _numbered_by_use(corners):
    seen = dict.fromkeys(corners)
    number = {corner: place for place, corner in enumerate(seen)}
    return [number[corner] for corner in corners]


def test_nothing_is_welded_to_nothing():
    welded, faces = weld(np.empty((0, 3), np.float32), np.empty((0, 3), np.int32))
    assert (welded.shape, faces.shape) == ((0, 3), (0, 3))


@given(seed=st.integers(0, 2**32 - 1))
def test_pairs_are_all_that_share_an_edge(seed):
    random = np.random.default_rng(seed)
    faces = np.array([random.choice(6, 3, replace=False) for _ in range(8)], dtype=np.int32)
    found = edge_pairs(faces)
    assert found.dtype == np.uint32
    assert len({tuple(sorted(pair)) for pair in found.tolist()}) == len(found)
    expected = [
        {3 * f + i, 3 * g + j}
        for f, g in combinations(range(8), 2)
        for i in range(3)
        for j in range(3)
        if {*np.delete(faces[f], i)} == {*np.delete(faces[g], j)}
    ]
    assert sorted(map(sorted, found.tolist())) == sorted(map(sorted, expected))
    assert edge_pairs(faces[:0]).shape == edge_pairs(faces[:1]).shape == (0, 2)
