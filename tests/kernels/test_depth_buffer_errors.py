"""Errors of triangles side by side, and errors without a bound."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.geometry.camera import Camera, Lens
from simplifier.kernels.depth_buffer import ERROR, TILE

ROWS, COLUMNS = 16, 24
AHEAD = Camera(np.zeros(3), np.diag([-1.0, 1.0, 1.0]), 70.0, 0.1)
WIDE, HIGH = 9.0, 8.3  # so that the cut goes through no corner of a pixel but the middle
SQUARE = np.array([[-WIDE, -HIGH], [WIDE, -HIGH], [WIDE, HIGH], [-WIDE, HIGH]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


@pytest.mark.parametrize("errors", [(0.0, 2.0), (2.0, 0.0), (1.0, 1.0), (0.5, 3.0)])
@pytest.mark.parametrize("coverage", ["centre", "inner"])
def test_where_two_triangles_meet_the_larger_error_holds(coverage, errors):
    """In depth: nothing is nearer than either may be; on the screen: for every tile."""
    depth = 5.0
    vertices = np.column_stack([SQUARE, np.full(4, depth)])
    buffer = DepthBuffer(ROWS, COLUMNS, coverage)
    buffer.draw_mesh(vertices, HALVES, AHEAD, np.array(errors))
    drawn = buffer.depth[:ROWS, :COLUMNS]
    # World x runs to the left of the picture and y upwards: the cut runs from corner to corner.
    x = (0.5 * COLUMNS - np.arange(COLUMNS + 1.0))[None, :]
    y = (0.5 * ROWS - np.arange(ROWS + 1.0))[:, None]
    below = x / WIDE - y / HIGH  # above 0 in the first triangle
    corners = [below[:-1, :-1], below[1:, :-1], below[:-1, 1:], below[1:, 1:]]
    first, second = np.min(corners, axis=0) > 1e-9, np.max(corners, axis=0) < -1e-9
    farthest = 1.0 / (depth + max(errors))
    middle = np.zeros(drawn.shape, dtype=bool)
    middle[ROWS // 2 - 1 : ROWS // 2 + 1, COLUMNS // 2 - 1 : COLUMNS // 2 + 1] = True
    first, second = first & ~middle, second & ~middle
    assert (drawn[~middle] > 0.0).all()
    for part, error in ((first, errors[0]), (second, errors[1])):
        assert (drawn[part] < 1.0 / (depth + error)).all()
        assert (drawn[part] > 1.0 / (depth + error) - 1e-5).all()
    if coverage == "inner":
        across = drawn[~first & ~second & ~middle]
        assert (across < farthest).all()
        assert (across > farthest - 1e-5).all()
        blur = max(errors) * Lens(ROWS, AHEAD.fov).focal / depth
        met = (~first & ~second).reshape(ROWS // TILE, TILE, -1, TILE).any(axis=(1, 3))
        assert (buffer.tiles[ERROR][met] >= blur).all()


@pytest.mark.parametrize("coverage", ["centre", "inner"])
@pytest.mark.parametrize("clipped", [False, True])
def test_an_error_without_a_bound_draws_nothing_and_blurs_nothing(clipped, coverage):
    """Nor the pixels that the triangle shares with one of a known error."""
    vertices = np.column_stack([SQUARE, [5.0, -50.0, 5.0, 5.0] if clipped else np.full(4, 5.0)])
    known, alone = DepthBuffer(ROWS, COLUMNS, coverage), DepthBuffer(ROWS, COLUMNS, coverage)
    alone.draw_mesh(vertices, HALVES[1:], AHEAD, 0.5)
    for errors in ([np.inf, 0.5], [np.inf, np.inf]):
        known.clear()
        known.draw_mesh(vertices, HALVES, AHEAD, np.array(errors))
        expected = alone if errors[1] == 0.5 else DepthBuffer(ROWS, COLUMNS, coverage)
        np.testing.assert_array_equal(known.depth, expected.depth)
        np.testing.assert_array_equal(known.tiles, expected.tiles)
    assert alone.tiles.any()
