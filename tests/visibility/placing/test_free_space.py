"""Free space in triangles: all of it, once, in edges that are bounded, and in no wall."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import generated_city, scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.camera_paths.street import AROUND
from simplifier.errors import OptionError
from simplifier.geometry.view_cells import PRISM, signed_areas
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.placing.free_space import free_space, triangles_of


def longest(triangles):
    return np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2).max()


def check(triangles, region, bound):
    """They fill the region but for slivers, none twice, and are no longer than the bound."""
    areas = signed_areas(triangles)
    assert (areas > 0.0).all()
    assert longest(triangles) <= bound
    together = shapely.union_all(shapely.polygons(triangles), grid_size=1e-9)
    assert together.area == pytest.approx(areas.sum(), rel=1e-6)
    assert shapely.difference(together, region.buffer(1e-6)).area == pytest.approx(0.0, abs=1e-6)
    assert areas.sum() == pytest.approx(region.area, rel=1e-3)


def smallest_angles(triangles):
    sides = np.roll(triangles, -1, axis=1) - triangles
    sides /= np.linalg.norm(sides, axis=2)[:, :, None]
    cosines = -np.einsum("ijk,ijk->ij", sides, np.roll(sides, 1, axis=1))
    return np.degrees(np.arccos(cosines.max(axis=1)))


def test_an_open_place_is_filled_with_round_triangles():
    region = shapely.box(0.0, 0.0, 100.0, 60.0)
    triangles = triangles_of(region, 9.0)
    check(triangles, region, 9.0)
    assert np.percentile(smallest_angles(triangles), 5) > 25.0
    assert len(triangles) < 4.0 * region.area / (0.433 * 81.0)


def test_a_place_no_larger_than_a_cell_is_two_triangles():
    region = shapely.box(0.0, 0.0, 3.0, 2.0)
    assert len(triangles_of(region, 10.0)) == 2


def test_narrow_ways_and_sharp_corners_are_divided_no_finer_than_they_are_long():
    corridor = shapely.box(0.0, 0.0, 90.0, 0.4)
    spike = shapely.Polygon([(0.0, 0.4), (3.0, 0.4), (1.5, 40.0)])
    region = shapely.union_all([corridor, spike])
    triangles = triangles_of(region, 10.0)
    check(triangles, region, 10.0)
    assert len(triangles) < 120


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_whatever_stands_there_the_rest_is_filled(seed):
    random = np.random.default_rng(seed)
    obstacles = []
    for _ in range(int(random.integers(0, 9))):
        angle, (w, d) = random.uniform(0.0, np.pi), random.uniform(0.3, 20.0, 2)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        corners = np.array([[0, 0], [w, 0], [w, d], [0, d]]) @ turn.T + random.uniform(0, 50, 2)
        obstacles.append(shapely.Polygon(corners))
    bound = float(random.uniform(3.0, 30.0))
    region = free_space(np.zeros(2), np.full(2, 50.0), obstacles, bound)
    for obstacle in obstacles:
        assert not region.intersects(obstacle)
    if not region.is_empty:
        check(triangles_of(region, bound), region, bound)


def test_cells_of_a_city_stand_on_its_streets_alone():
    upright = UprightScene.of(generated_city(3), "z")
    options = PvsOptions(up="z", cell_size=12.0)
    cells = place_cells(upright, "triangles", options)
    assert (cells.kinds == PRISM).all()
    assert longest(cells.corners) <= 12.0
    assert (cells.low[:, 2] == 0.0).all()
    assert cells.high[:, 2] == pytest.approx(options.eye_height)
    plans = shapely.box(*upright.boxes[:, 0, :2].T, *upright.boxes[:, 1, :2].T)
    tree = shapely.STRtree(plans)
    assert not len(tree.query(shapely.polygons(cells.corners), predicate="intersects")[0])
    plan = upright.extent[:2] + 2.0 * AROUND * options.eye_height
    streets = np.prod(plan) - shapely.union_all(plans).area
    assert 0.9 * streets < signed_areas(cells.corners).sum() < streets


def test_kerbs_and_what_is_overhead_are_in_nobodys_way_and_gates_are():
    boxes = np.array(
        [
            [(0.0, 0.0, 0.0), (4.0, 40.0, 9.0)],
            [(10.0, 10.0, 0.0), (14.0, 14.0, 0.2)],
            [(20.0, 10.0, 5.0), (24.0, 14.0, 6.0)],
            [(30.0, 10.0, 1.0), (34.0, 14.0, 6.0)],
            [(36.0, 0.0, 0.0), (40.0, 40.0, 9.0)],
        ]
    )
    upright = UprightScene.of(scene_of_boxes(boxes, ["a", "kerb", "bridge", "gate", "b"]), "z")
    cells = place_cells(upright, "triangles", PvsOptions(up="z", cell_size=10.0))

    def holds(x, y):
        return len(cells.containing(np.array([x, y, 1.0]))) > 0

    assert [holds(x + 2.1, 12.1) for x in (0.0, 10.0, 20.0, 30.0, 36.0)] == [
        False, True, True, False, False,
    ]  # fmt: skip


def test_where_nothing_is_free_that_is_said(monkeypatch):
    monkeypatch.setattr("simplifier.visibility.placing.cells.AROUND", 0.0)
    scene = scene_of_boxes(np.array([[(0.0, 0.0, 0.0), (9.0, 9.0, 9.0)]]), ["all"])
    with pytest.raises(OptionError, match="no place to stand on"):
        place_cells(UprightScene.of(scene, "z"), "triangles", PvsOptions(up="z"))
