"""Cull maps from prisms: what any point of a triangle sees is in its set, however it is turned."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.visibility_city import generated_city, scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells, signed_areas
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.cull_maps.cull_map import CullMaps, _samples, see_by_cull_maps
from simplifier.visibility.cull_maps.erosion import Window, sectors
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.cull_maps.test_cull_map import named, proven, sets, slits
from tests.visibility.scenes import one_box, puzzle, street_cell, wall_with_a_gap
from tests.visibility.solid.test_height_field import upright

ANGLES = np.radians([0.0, 17.0, 45.0, 67.0, 101.0, 208.0])


def prism(corners, eye=2.0):
    return ViewCells.prisms(np.array([corners], dtype=np.float64), np.zeros(1), np.full(1, eye))


def rotation(angle):
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def turned(scene, angle):
    turn = np.eye(4)
    turn[:2, :2] = rotation(angle)
    return replace(scene, transforms=turn @ scene.transforms)


def slanted_slits(seed, angle, deep=7.0):
    """The slits of the boxes' test, turned, and a triangle with an edge towards them.

    The points are off that edge by less than rounding to float32.
    """
    scene, _, points = slits(seed, deep=deep)
    turn = rotation(angle)
    corners = np.array([[5.0, -5.0], [5.0, 5.0], [-1.0, 0.7]]) @ turn.T
    points[:, :2] = points[:, :2] @ turn.T
    return turned(scene, angle), prism(corners), points


def missed_in_slits(pixels=(0.1, 0.9), spacing=10.5, deep=7.0):
    """Posts behind slits that are not in the set though they are seen."""
    missed = 0
    for seed, angle in enumerate(ANGLES):
        scene, cells, points = slanted_slits(seed, angle, deep)
        seen = proven(scene, points)
        assert seen[-3:].all()
        for pixel in pixels:
            missed += int((seen & ~sets(scene, cells, pixel, spacing)[0]).sum())
    return missed


@pytest.mark.slow
def test_what_shows_through_slits_beside_a_slanted_edge_is_in_the_set():
    assert missed_in_slits() == 0
    assert missed_in_slits((0.3,), 2.5) == 0
    assert missed_in_slits((0.1,), 10.5, 21.0) == 0


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_an_erosion_along_the_edge_that_is_left_out_or_short_is_found_out(monkeypatch, share):
    whole = Window.sector
    monkeypatch.setattr(
        "simplifier.visibility.cull_maps.cull_map.Window.sector",
        lambda index, count, half: whole(index, count, share * half),
    )
    assert missed_in_slits((0.1,), 10.5, 21.0) > 0


@pytest.mark.slow
def test_a_sample_that_is_left_out_is_found_out(monkeypatch):
    def fewer(*given):
        rows, kinds, free = _samples(*given)
        return rows[-1:], kinds[-1:], free

    monkeypatch.setattr("simplifier.visibility.cull_maps.cull_map._samples", fewer)
    assert missed_in_slits((0.1,), 2.5) > 0


def test_a_pixel_that_is_not_visited_is_found_out():
    scene, cells, points = slanted_slits(0, ANGLES[1])
    seen = proven(scene, points)
    around = np.array([cells.low[0, :2], cells.high[0, :2]])
    field = height_field(upright(scene), 0.9, around)
    post = scene.bounds()[-1]
    first, last = np.floor((post[:, :2] - field.low) / field.cell).astype(int)
    there = np.zeros(field.shape, np.bool_)
    there[first[0] : last[0] + 1, first[1] : last[1] + 1] = True
    counts = np.diff(field.starts)
    kept = np.repeat(~there.ravel(), counts)
    starts = np.concatenate([[0], np.cumsum(np.where(there.ravel(), 0, counts))]).astype(np.int32)
    fewer = replace(
        field, starts=starts, objects=field.objects[kept], object_tops=field.object_tops[kept]
    )
    whole = see_by_cull_maps(CullMaps(field, 2.5), cells)[0][0]
    less = see_by_cull_maps(CullMaps(fewer, 2.5), cells)[0][0]
    assert not (seen & ~whole).any()
    assert (seen & ~less).any()


def penumbrae_that_meet():
    """Figure 2 c of the paper: neither hides the house by itself from all of the cell."""
    boxes = {
        "right": ((20.0, 23.0), (-30.0, 2.0), 30.0),
        "left": ((30.0, 33.0), (-1.0, 40.0), 30.0),
        "house": ((60.0, 62.0), (-0.5, 1.5), 10.0),
    }
    return puzzle(boxes, ["right", "left"], ["house"])


@pytest.mark.parametrize(
    "posed", [one_box(), penumbrae_that_meet(), wall_with_a_gap(2.0, 10.0)],
    ids=["box", "penumbrae", "gap"],
)  # fmt: skip
@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_both_halves_of_a_square_see_what_it_sees_and_no_more(posed, angle):
    square = street_cell().outline(0) @ rotation(angle).T
    cells = ViewCells.joined(prism(square[[0, 1, 2]]), prism(square[[0, 2, 3]]))
    found = sets(turned(posed.scene, angle), cells, 0.2, 0.8).any(axis=0)
    assert posed.seen <= named(posed.scene, found)
    assert not posed.hidden & named(posed.scene, found)


@pytest.mark.parametrize("left", ["right", "left"])
def test_neither_of_two_boxes_hides_by_itself_what_both_hide(left):
    posed = penumbrae_that_meet()
    kept = np.array([name != left for name in posed.scene.names])
    fewer = scene_of_boxes(posed.scene.bounds()[kept], np.array(posed.scene.names)[kept].tolist())
    square = street_cell().outline(0)
    cells = ViewCells.joined(prism(square[[0, 1, 2]]), prism(square[[0, 2, 3]]))
    assert "house" in named(fewer, sets(fewer, cells, 0.2, 0.8).any(axis=0))


@cache
def small_city():
    """With triangles of its streets, and their sets."""
    city = generated_city(3, seed=2)
    cells = place_cells(upright(city), "triangles", PvsOptions(up="z", cell_size=9.0))
    cells = cells.some(np.arange(0, len(cells), 40))
    return city, cells, sets(city, cells, 1.0)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_turning_the_scene_by_right_angles_turns_its_sets(turns):
    city, cells, plain = small_city()
    cosine, sine = [(0, 1), (-1, 0), (0, -1)][turns - 1]
    turn = np.array([[cosine, -sine], [sine, cosine]], dtype=np.float64)
    ends = city.bounds()
    plans = ends[:, :, :2] @ turn.T
    ends[:, 0, :2], ends[:, 1, :2] = plans.min(axis=1), plans.max(axis=1)
    there = ViewCells.prisms(cells.corners @ turn.T, cells.low[:, 2], cells.high[:, 2])
    scene = scene_of_boxes(ends, list(city.names))
    assert np.array_equal(plain, sets(scene, there, 1.0))


def test_all_that_any_point_of_free_space_sees_of_a_city_is_in_its_set():
    city = generated_city(4, seed=5)
    cells = place_cells(UprightScene.of(city, "z"), "triangles", PvsOptions(up="z"))
    cells = cells.some(np.arange(3, len(cells), len(cells) // 12))
    there = UprightScene.of(city, "z")
    around = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    for pixel, spacing in ((1.0, 10.0), (2.0, 5.0)):
        field = height_field(there, pixel, around)
        found, _ = see_by_cull_maps(CullMaps(field, spacing), cells)
        for cell in range(len(cells)):
            points = viewpoints(cells, cell, 40, np.random.default_rng(cell))
            seen = proven(city, points + there.origin)
            assert not (seen & ~found[cell]).any()
        assert found.mean() < 0.7


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_set_holds_what_is_seen_whatever_stands_around_and_in_the_cell(seed):
    random = np.random.default_rng(seed)
    corners = random.uniform(-8.0, 8.0, (3, 2))
    if abs(signed_areas(corners[None])[0]) < 2.0:
        corners = np.array([[0.0, 0.0], [7.0, 1.0], [2.0, 6.0]])
    count = int(random.integers(3, 14))
    low = np.column_stack([random.uniform(-30.0, 30.0, (count, 2)), np.zeros(count)])
    size = np.column_stack([random.uniform(0.5, 14.0, (count, 2)), random.uniform(0.5, 9, count)])
    scene = scene_of_boxes(np.stack([low, low + size], axis=1), [f"{i}" for i in range(count)])
    scene = turned(scene, random.uniform(0.0, np.pi))
    cells = prism(corners, random.uniform(0.5, 6.0))
    seen = proven(scene, viewpoints(cells, 0, 30, random), 180)
    pixel = float(random.choice([0.2, 0.5, 1.0]))
    found = sets(scene, cells, pixel, pixel * float(random.choice([2.0, 7.0, 10.0])))[0]
    assert not (seen & ~found).any()


def test_walls_at_the_border_of_a_cell_hide_and_those_within_do_not():
    beside = [(-40.0, 5.0, 0.0), (40.0, 15.0, 9.0)]
    behind = [(-2.0, 30.0, 0.0), (2.0, 34.0, 5.0)]
    scene = scene_of_boxes(np.array([beside, behind]), ["wall", "behind"])
    cells = prism([[-5.0, 5.0], [0.0, -5.0], [5.0, 5.0]])
    assert named(scene, sets(scene, cells, 0.5, 5.0)[0]) == {"wall"}
    within = prism([[-5.0, 6.0], [0.0, -5.0], [5.0, 6.0]])
    assert named(scene, sets(scene, within, 0.5, 5.0)[0]) == {"wall"}
    across = prism([[-5.0, 14.0], [0.0, -5.0], [5.0, 14.0]])
    assert named(scene, sets(scene, across, 0.5, 5.0)[0]) == {"wall", "behind"}


def test_an_odd_number_of_sectors_is_never_made():
    assert {sectors(half) % 2 for half in np.linspace(0.01, 60.0, 400)} == {0}
