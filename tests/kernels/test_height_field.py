"""Heights of triangles over pixels, and pixels of outlines, against exact polygons."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from simplifier.kernels.height_field import fill_outline, measure_object

START = np.array([-2, 1], dtype=np.int64)
SHAPE = (6, 5)


def pixel(i, j):
    x, y = START + np.array([i, j])
    return shapely.box(x, y, x + 1, y + 1)


@pytest.mark.parametrize("seed", range(8))
def test_triangles_are_as_high_and_low_as_over_each_pixel(seed):
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1.0, 8.0, (6, 3)) - np.array([2.5, 0.0, 0.0])
    faces = np.array([[0, 1, 2], [5, 4, 3]], dtype=np.int32)
    ends = np.array([True, bool(seed % 2)])
    roofs, tops = np.full(SHAPE, np.inf), np.full(SHAPE, -np.inf)
    measure_object(vertices, faces, ends, START, roofs, tops)
    for i, j in np.ndindex(*SHAPE):
        low, high = np.inf, -np.inf
        for face, ending in zip(faces, ends, strict=True):
            corners = vertices[face]
            part = shapely.Polygon(corners[:, :2]).intersection(pixel(i, j))
            if part.is_empty:
                continue
            plane = np.linalg.solve(np.column_stack([corners[:, :2], np.ones(3)]), corners[:, 2])
            heights = shapely.get_coordinates(part) @ plane[:2] + plane[2]
            high = max(high, heights.max())
            low = min(low, heights.min()) if ending else low
        assert tops[i, j] == pytest.approx(high, abs=1e-6)
        assert roofs[i, j] == pytest.approx(low, abs=1e-6)


def test_an_upright_triangle_has_the_heights_of_its_edge():
    vertices = np.array([[0.5, 2.0, 1.0], [0.5, 4.5, 1.0], [0.5, 4.5, 6.0]])
    roofs, tops = np.full(SHAPE, np.inf), np.full(SHAPE, -np.inf)
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    measure_object(vertices, faces, np.ones(1, np.bool_), START, roofs, tops)
    assert np.allclose(tops[2], [1.0, 3.0, 5.0, 6.0, -np.inf])
    assert np.allclose(roofs[2], [1.0, 1.0, 1.0, 1.0, np.inf])
    assert np.isneginf(np.delete(tops, 2, axis=0)).all()


@pytest.mark.parametrize("seed", range(12))
def test_outlines_cross_the_pixels_that_they_touch_and_hold_centres(seed):
    random = np.random.default_rng(seed)
    angles = np.sort(random.uniform(0.0, 2.0 * np.pi, 7))
    reach = random.uniform(0.5, 4.0, (7, 1))
    outer = reach * np.column_stack([np.cos(angles), np.sin(angles)]) + [1.0, 3.5]
    if seed % 3 == 0:
        outer = np.round(outer)
    rings = [np.concatenate([outer, outer[:1]])]
    if seed % 2:
        hole = 0.3 * (outer - [1.0, 3.5]) + [1.0, 3.5]
        rings.append(np.concatenate([hole, hole[:1]])[::-1])
    crossed, inside = np.zeros(SHAPE, np.bool_), np.zeros(SHAPE, np.bool_)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.int64)
    fill_outline(np.concatenate(rings), ends, START, crossed, inside)
    lines = shapely.MultiLineString(rings)
    for i, j in np.ndindex(*SHAPE):
        assert crossed[i, j] == lines.intersects(pixel(i, j))
        if not crossed[i, j]:
            centre = shapely.Point(START + np.array([i + 0.5, j + 0.5]))
            parity = sum(shapely.Polygon(ring).contains(centre) for ring in rings) % 2
            assert inside[i, j] == bool(parity)


def test_a_flat_roof_is_in_all_pixels_that_it_touches():
    vertices = np.array([[0.0, 2.0, 7.0], [1.0, 2.0, 7.0], [1.0, 3.0, 7.0], [0.0, 3.0, 7.0]])
    faces = np.array([[0, 1, 2], [2, 3, 0]], dtype=np.int32)
    roofs, tops = np.full(SHAPE, np.inf), np.full(SHAPE, -np.inf)
    measure_object(vertices, faces, np.ones(2, np.bool_), START, roofs, tops)
    expected = np.full(SHAPE, -np.inf)
    expected[1:4, 0:3] = 7.0  # the one that it fills, and those that share its borders
    assert np.array_equal(tops, expected)
    assert np.array_equal(roofs, np.where(np.isfinite(expected), 7.0, np.inf))


def test_outlines_with_corners_at_the_height_of_centres_and_beyond_the_window():
    for corners in (
        [[-1.7, 2.5], [0.2, 1.5], [2.2, 2.5], [0.2, 4.5]],
        [[-9.0, -9.0], [3.3, -9.0], [3.3, 9.0], [-9.0, 9.0]],
        [[-9.0, 1.2], [9.0, 1.2], [9.0, 4.4], [-9.0, 4.4]],
        [[-1.5, 0.0], [1.5, 0.0], [1.5, 9.0], [-1.5, 9.0]],
    ):
        for ring in (corners, corners[::-1]):
            points = np.array([*ring, ring[0]])
            crossed, inside = np.zeros(SHAPE, np.bool_), np.zeros(SHAPE, np.bool_)
            fill_outline(points, np.array([len(points)]), START, crossed, inside)
            plan = shapely.Polygon(ring)
            for i, j in np.ndindex(*SHAPE):
                assert crossed[i, j] == plan.exterior.intersects(pixel(i, j))
                if not crossed[i, j]:
                    assert inside[i, j] == plan.contains(pixel(i, j))
