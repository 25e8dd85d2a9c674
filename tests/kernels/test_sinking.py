"""Corners sunk in a room, beside whole arrays of numpy, to the last bit."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.kernels.sinking import read_between, sink

seeds = st.integers(0, 10_000)


@given(seed=seeds)
def test_values_between_cells_and_beyond_the_grid(seed):
    random = np.random.default_rng(seed)
    field = random.random(tuple(random.integers(1, 12, 3)))
    points = random.uniform(-2.0, np.array(field.shape) + 2.0, (40, 3))
    points[:10] = np.round(points[:10])
    expected = ndimage.map_coordinates(field, points.T, order=1, mode="nearest")
    assert [read_between(field, point) for point in points] == expected.tolist()


@given(seed=seeds)
def test_corners_sink_the_way_of_all_their_faces(seed):
    random = np.random.default_rng(seed)
    depth, points = random.random((5, 4, 6)), random.uniform(-1.0, 13.0, (9, 3))
    faces = random.integers(0, 8, (11, 3), dtype=np.int32)  # the last point has none
    inside = random.random(11) < 0.4
    found = points.copy()
    sink(found, faces, inside, depth, 2.0, np.empty((9, 3)), 0.25)

    outside = faces[~inside]
    centres = (points[outside].mean(axis=1) / 2.0 - 0.5).T
    slopes = np.empty((len(outside), 3))
    for axis, aside in enumerate(np.eye(3)[:, :, None]):
        low, high = (
            ndimage.map_coordinates(depth, centres + side * aside, order=1, mode="nearest")
            for side in (-1.0, 1.0)
        )
        slopes[:, axis] = high - low
    ways = np.zeros((9, 3))
    for corner in range(3):
        np.add.at(ways, outside[:, corner], slopes)
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    units = np.divide(ways, lengths, out=np.zeros_like(ways), where=lengths > 0.0)
    assert np.array_equal(found, points + 0.25 * units)
    assert np.array_equal(found[8], points[8])
