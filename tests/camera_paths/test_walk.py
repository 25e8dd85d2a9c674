"""The parts of a walk: cells of a segment, smoothing, steps, tours, ground, doors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from simplifier.camera_paths.columns import Columns, UprightScene, window
from simplifier.camera_paths.street import ground_heights, steep
from simplifier.camera_paths.walk import (
    Space,
    Ways,
    crossed_cells,
    equal_steps,
    smooth,
    tour,
    views,
)
from tests.solids import box
from tests.walkable import moved, scene_of

place = st.tuples(*[st.floats(0.0, 9.0)] * 3).map(np.array)


@given(a=place, b=place)
def test_crossed_cells_are_those_of_dense_samples(a, b):
    cells, spans = crossed_cells(a, b)
    assert (np.diff(spans, axis=1) >= 0.0).all()
    assert (spans[0, 0], spans[-1, 1]) == (0.0, 1.0)
    assert np.array_equal(spans[1:, 0], spans[:-1, 1])
    known = {tuple(cell) for cell in cells}
    for share in np.linspace(0.0, 1.0, 301)[1:-1]:
        point = a + share * (b - a)
        if np.abs(point - np.round(point)).min() > 1e-6:
            assert tuple(np.floor(point).astype(int)) in known


def in_square(points):
    return ((points[:, :2] > 0.0) & (points[:, :2] < 10.0)).all(axis=1)


def around_a_post(starts, ends):
    """Nothing may come nearer to (5, 5) than 1."""
    shares = np.linspace(0.0, 1.0, 200)[:, None, None]
    ways = starts + shares * (ends - starts)
    return (np.linalg.norm(ways[..., :2] - 5.0, axis=2) > 1.0).all(axis=0)


CORNER = np.array(
    [[4.0, float(y), 0.0] for y in range(1, 9)] + [[float(x), 8.0, 0.0] for x in (5, 6, 7, 8)]
)


def test_smoothing_rounds_corners_and_keeps_the_ends():
    route = smooth(CORNER, Space(in_square, around_a_post))
    turns = [np.diff(np.diff(line, axis=0), axis=0) for line in (CORNER, route)]
    assert np.linalg.norm(turns[1], axis=1).max() < 0.5 * np.linalg.norm(turns[0], axis=1).max()
    assert np.array_equal(route[[0, -1]], CORNER[[0, -1]])


def test_smoothing_keeps_to_what_is_allowed():
    def nowhere(points):
        return np.zeros(len(points), dtype=bool)

    assert np.array_equal(smooth(CORNER, Space(nowhere, around_a_post)), CORNER)


def test_steps_are_equal_and_cross_nothing():
    space = Space(in_square, around_a_post)
    path = equal_steps(CORNER, 5, 100.0, space)
    assert around_a_post(path[:-1], path[1:]).all()
    assert len(equal_steps(CORNER, 40, 0.1, space)) == 40
    lengths = np.linalg.norm(np.diff(equal_steps(CORNER, 40, 0.1, space), axis=0), axis=1)
    assert lengths == pytest.approx(0.1, rel=1e-6)


def test_steps_where_nothing_is_clear_stay_in_place():
    space = Space(in_square, lambda starts, ends: np.zeros(len(starts), dtype=bool))
    assert np.array_equal(equal_steps(CORNER, 3, 1.0, space), CORNER[[0, 0, 0]])


@pytest.mark.parametrize("count", [1, 2, 50])
def test_views_of_a_walk_that_stands_still(count):
    looks = views(np.zeros((count, 3)), np.random.default_rng(0), turn=30.0, tilt=-10.0)
    assert np.linalg.norm(looks, axis=1) == pytest.approx(1.0)
    assert looks[:, 2] == pytest.approx(np.sin(np.radians(-10.0)))


def line_of(count):
    places = np.column_stack([np.arange(count), np.zeros(count), np.zeros(count)]).astype(float)
    pairs = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    return Ways.between(places, pairs, np.ones(count))


def test_a_tour_goes_to_both_ends():
    route = tour(line_of(50), np.ones(50, dtype=bool), 1000.0, np.random.default_rng(0))
    assert {0.0, 49.0} <= set(route[:, 0])
    assert np.abs(np.diff(route[:, 0])).max() == 1.0


def test_a_tour_keeps_within_reach_and_to_the_sights():
    sights = np.zeros(1000, dtype=bool)
    sights[500::100] = True
    route = tour(line_of(1000), sights, 150.0, np.random.default_rng(0))
    assert 100.0 <= np.ptp(route[:, 0]) <= 300.0
    assert set(route[[0, -1], 0]) <= set(np.nonzero(sights)[0])


def test_unwelcome_places_are_gone_around():
    """A square of four: one of the two ways round costs more."""
    places = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    pairs = np.array([[0, 1], [1, 2], [0, 3], [3, 2]])
    ways = Ways.between(places, pairs, np.array([1.0, 9.0, 1.0, 1.0]))
    sights = np.array([True, False, True, False])
    route = tour(ways, sights, 100.0, np.random.default_rng(0))
    assert sorted(map(tuple, route[:, :2])) == [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


def test_one_sight_is_a_tour():
    sights = np.arange(50) == 7
    route = tour(line_of(50), sights, 1000.0, np.random.default_rng(0))
    assert route.tolist() == [[7.0, 0.0, 0.0]]


# Ground.


def columns_with(lows, highs, cell=1.0):
    return Columns(np.zeros(2), cell, lows, highs)


def test_ground_of_a_hill_with_houses():
    x, y = np.meshgrid(np.arange(120.0), np.arange(90.0), indexing="ij")
    hill = 0.2 * x
    highs = hill + np.where((x % 30 < 15) & (y % 30 < 15), 12.0, 0.0)
    ground, surface = ground_heights(columns_with(hill.copy(), highs), 120.0 * 90.0, 1.7)
    assert not surface[highs > hill].any()
    beside = ndimage.binary_dilation(highs > hill)  # steep: not walked on
    assert surface[:99][~beside[:99]].all()  # the slope's upper end is lost
    assert np.array_equal(ground[surface], hill[surface])
    assert np.abs(ground - hill)[:99].max() < 3.0


def test_ground_without_one_is_that_of_the_bases():
    """Walls alone reach down; the roofs between them hang in the air."""
    lows, highs = np.full((90, 90), np.inf), np.full((90, 90), -np.inf)
    for x, y in np.ndindex(3, 3):
        inner, outer = (slice(30 * x + 1, 30 * x + 14), slice(30 * y + 1, 30 * y + 14)), (
            slice(30 * x, 30 * x + 15), slice(30 * y, 30 * y + 15),
        )  # fmt: skip
        lows[outer], highs[outer] = 5.0, 14.0
        lows[inner] = 14.0
    ground, surface = ground_heights(columns_with(lows, highs), 90.0 * 90.0, 1.7)
    assert not surface.any()
    assert ground == pytest.approx(np.full((90, 90), 5.0))


def test_steep_is_more_than_45_degrees():
    heights = np.array([[0.0, 0.9, 1.9, 4.0, 4.0], [0.0, 0.9, 1.9, 4.0, -np.inf]])
    assert steep(heights, 1.0).tolist() == [
        [False, False, True, True, True], [False, False, True, True, True],
    ]  # fmt: skip


# The upright scene.


@pytest.mark.parametrize("up", ["x", "y", "z"])
def test_upright_and_back(up):
    scene = moved(scene_of(box((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))), (1e6, 2e6, 3e6), up)
    upright = UprightScene.of(scene, up)
    assert upright.extent == pytest.approx([1.0, 2.0, 3.0], abs=1e-8)
    ((vertices, _),) = upright.triangles(np.zeros(3), upright.extent)
    assert vertices.min(axis=0) == pytest.approx([0.0, 0.0, 0.0])
    assert vertices.flags.c_contiguous
    world = scene.joined([0]).vertices
    assert upright.to_world(vertices) == pytest.approx(world, abs=1e-9)


def test_triangles_of_a_box_are_those_of_its_objects():
    scene = scene_of(*(box((1.0, 1.0, 1.0), (10.0 * i, 0.0, 0.0)) for i in range(5)))
    upright = UprightScene.of(scene, "z")
    found = list(upright.triangles(np.array([9.0, 0.0, 0.0]), np.array([22.0, 1.0, 1.0])))
    assert sum(len(faces) for _, faces in found) == 24
    assert list(upright.triangles(np.array([3.0, 0.0, 0.0]), np.array([4.0, 1.0, 1.0]))) == []


@pytest.mark.parametrize(
    ("name", "door"),
    [
        ("IfcDoor:Tuer-1:0Lt8gR_E9", True), ("Front Door", True), ("door_12", True),
        ("DOORS", True), ("SM_door01", True), ("indoor plant", False), ("Outdoor", False),
        ("wall", False), ("Dorado", False), ("doorbell", False),
    ],
)  # fmt: skip
def test_doors_are_told_by_name(name, door):
    scene = scene_of(box(), box(), names=("wall of stone", name))
    left = UprightScene.of(scene, "z").without_doors()
    assert left.scene.names == (("wall of stone",) if door else ("wall of stone", name))
    assert len(left.boxes) == len(left.scene.mesh_of) == len(left.scene.names)


def test_the_window_of_a_large_scene_is_its_densest_part():
    houses = [box((10.0, 10.0, 8.0), (900.0 + 20.0 * i, 300.0 + 20.0 * j, 0.0))
              for i in range(8) for j in range(8)]  # fmt: skip
    far = box((10.0, 10.0, 8.0), (0.0, 0.0, 0.0))
    low, high = window(UprightScene.of(scene_of(far, *houses), "z"), 200.0)
    assert (high - low).tolist() == [200.0, 200.0]
    assert (low < [920.0, 320.0]).all()
    assert (high > [1030.0, 430.0]).all()
