"""Three ways to shrink occluders give the same but for what they waste, and never too much."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from bench.visibility_city import generated_city
from bench.visibility_shrinking import (
    Roofs,
    by_exterior,
    by_outlines,
    by_pixels,
    eroded,
    gabled,
    shrinking_rows,
)
from simplifier.camera_paths.columns import UprightScene
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.solid.height_field import height_field


def field_and_roofs(scene):
    upright = UprightScene.of(scene, "z")
    plan = np.array([[0.0, 0.0], [1.0, 1.0]])
    return height_field(upright, 1.0, plan), Roofs.of(upright)


@pytest.mark.parametrize("window", [Window.box(5, 1), Window.box(1, 4)])
def test_exact_ways_agree_and_keep_no_less_than_pixels(window):
    field, roofs = field_and_roofs(generated_city(1, seed=3))
    pixels, outlines, exterior = (
        way(roofs, field, window) for way in (by_pixels, by_outlines, by_exterior)
    )
    assert (pixels <= outlines).all()
    assert np.isfinite(pixels).sum() > 100
    both = np.isfinite(outlines)
    assert np.array_equal(both, np.isfinite(exterior))
    assert outlines[both] == pytest.approx(exterior[both])
    assert both.sum() <= 1.1 * np.isfinite(pixels).sum()


def test_no_way_leaves_more_than_there_is_around_a_pixel():
    city = gabled(generated_city(1, seed=3))
    field, roofs = field_and_roofs(city)
    window = Window.box(5, 1)
    pixels, exterior = by_pixels(roofs, field, window), by_exterior(roofs, field, window)
    assert (pixels <= exterior + 1e-4).all()
    assert (pixels < exterior - 0.01).any()
    random = np.random.default_rng(0)
    some = random.permutation(np.argwhere(np.isfinite(exterior)))[:200]
    for x, y in some:
        points = np.array([x, y]) + random.random((50, 2))
        points[:25, 0] += random.uniform(-5.0, 5.0, 25)
        points[25:] += random.uniform(-1.0, 1.0, (25, 2))
        assert exterior[x, y] <= least_height(roofs, points * field.cell + field.low) + 1e-4


def least_height(roofs, points):
    """The lowest roof over any of the points (k, 2), minus infinite where there is none."""
    a, b, c = roofs.triangles.swapaxes(0, 1)[:, None]
    one, two, to = b - a, c - a, points[:, None] - a[..., :2]
    area = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    u = (to[..., 0] * two[..., 1] - to[..., 1] * two[..., 0]) / area
    v = (one[..., 0] * to[..., 1] - one[..., 1] * to[..., 0]) / area
    inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
    heights = a[..., 2] + u * one[..., 2] + v * two[..., 2]
    return np.where(inside, heights, -np.inf).max(axis=1).min()


def test_plans_lose_what_a_set_reaches_out_of():
    plan = shapely.Polygon([(0, 0), (9, 0), (9, 4), (4, 4), (4, 9), (0, 9)])
    left = eroded(plan, shapely.box(-1.0, -0.5, 1.0, 0.5))
    expected = shapely.union(shapely.box(1, 0.5, 8, 3.5), shapely.box(1, 0.5, 3, 8.5))
    assert left.symmetric_difference(expected).area == pytest.approx(0.0, abs=1e-9)
    assert eroded(plan, shapely.box(-3.0, -3.0, 3.0, 3.0)).is_empty


def test_a_slope_has_no_outline_of_its_own():
    field, roofs = field_and_roofs(gabled(generated_city(1)))
    with pytest.raises(ValueError, match="not flat"):
        by_outlines(roofs, field, Window.box(2, 1))


def test_rows_tell_of_every_way_and_none_leaks():
    rows = list(shrinking_rows(2, 4, 10.0))
    assert [(row["roofs"], row["way"]) for row in rows] == [
        ("flat", "pixels"), ("flat", "outlines"), ("flat", "exterior"),
        ("gables", "pixels"), ("gables", "exterior"),
    ]  # fmt: skip
    assert not any(row["leaks"] for row in rows)
    for exact, pixels in ((1, 0), (2, 0), (4, 3)):
        assert 1.0 <= rows[exact]["sets_to_seen"] <= rows[pixels]["sets_to_seen"]
