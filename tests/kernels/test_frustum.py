"""Which boxes lie beside a view, in exact arithmetic's place: plain numpy."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import screen_view
from simplifier.kernels.frustum import mark_outside
from tests.rasters import random_camera

ROWS, COLUMNS = 24, 32


def outside(boxes, view):
    found = np.empty(len(boxes), dtype=np.bool_)
    mark_outside(boxes, view, found)
    return found


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_box_is_outside_when_all_corners_are_beyond_one_plane(seed):
    rng = np.random.default_rng(seed)
    camera = random_camera(rng)
    centres = camera.position + rng.normal(size=(20, 3)) * 5.0
    halves = rng.uniform(0.01, 1.5, (20, 3))
    boxes = np.stack([centres - halves, centres + halves], axis=1)
    view = screen_view(camera, ROWS, COLUMNS)
    ends = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    corners = boxes[:, ends, [0, 1, 2]] - view[:3]
    x, y, z = np.moveaxis(corners @ view[3:12].reshape(3, 3).T, -1, 0)
    planes = np.stack([x, y, COLUMNS * z - x, ROWS * z - y, z - camera.near])
    np.testing.assert_array_equal(outside(boxes, view), (planes < 0.0).all(axis=2).any(axis=0))


def test_a_box_on_a_plane_and_what_is_no_number_are_not_outside():
    view = np.array([0, 0, 0, -2, 0, 2, 0, -2, 2, 0, 0, 1, 2, 0.25, 4, 4])  # a right angle's
    boxes = np.array([
        [[1.0, 0.0, 1.0], [2.0, 0.5, 1.0]], [[-2.0, 0.0, 1.0], [-1.0, 0.5, 1.0]],
        [[0.0, 1.0, 1.0], [0.5, 2.0, 1.0]], [[0.0, -2.0, 1.0], [0.5, -1.0, 1.0]],
        [[0.0, 0.0, 0.0], [0.1, 0.1, 0.25]],
        [[np.nan, 0.0, -9.0], [0.1, 0.1, -8.0]], [[0.0, 0.0, -np.inf], [0.1, 0.1, -8.0]],
    ])  # fmt: skip
    assert not outside(boxes, view).any()
