"""Cull maps: what a cell sees is in its set, and what is hidden mostly is not."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import viewpoints
from simplifier.visibility.checking.exact_view import prisms_of, seen_from
from simplifier.visibility.cull_maps.cull_map import CullMaps, _samples, see_by_cull_maps
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.solid.height_field import height_field
from tests.visibility.scenes import PUZZLES, city_on_a_slab, city_on_terrain, street_cell
from tests.visibility.solid.test_height_field import upright


def sets(scene, cells, pixel=0.5, spacing=2.5, ground=False):
    """(c, n) what each cell may see."""
    around = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    field = height_field(upright(scene), pixel, around, ground)
    return see_by_cull_maps(CullMaps(field, spacing), cells)[0]


def named(scene, row):
    return {name for name, seen in zip(scene.names, row, strict=True) if seen}


def proven(scene, points, azimuths=720):
    prisms = prisms_of(scene, "z")
    return ~np.isnan(seen_from(prisms, points - prisms.origin, azimuths)).all(axis=0)


@pytest.mark.parametrize("make", PUZZLES)
@pytest.mark.parametrize("pixel", [0.25, 1.0])
def test_what_is_seen_in_scenes_built_against_it(make, pixel):
    puzzle = make()
    found = named(puzzle.scene, sets(puzzle.scene, puzzle.cells, pixel)[0])
    assert puzzle.seen <= found


@pytest.mark.sweep(4)
@pytest.mark.parametrize("make", PUZZLES)
def test_what_is_hidden_with_fine_pixels_and_many_samples(make):
    puzzle = make()
    found = named(puzzle.scene, sets(puzzle.scene, puzzle.cells, 0.1, 0.2)[0])
    assert not puzzle.hidden & found
    assert puzzle.seen <= found


@pytest.mark.sweep(3)
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("pixel", "spacing"), [(1.0, 10.0), (2.0, 5.0), (0.7, 1.3)])
def test_all_that_any_point_of_a_cell_sees_of_a_city_is_in_its_set(seed, pixel, spacing):
    city = generated_city(5, seed=seed)
    cells = street_cells(city, 6, seed=seed)
    found = sets(city, cells, pixel, spacing)
    for cell in range(len(cells)):
        seen = proven(city, viewpoints(cells, cell, 40, np.random.default_rng(seed)))
        assert not (seen & ~found[cell]).any()
        assert seen.sum() > 5
    assert found.mean() < 0.6


def test_finer_pixels_and_more_samples_show_less():
    city = generated_city(4, seed=5)
    cells = street_cells(city, 4, seed=5)
    coarse, fine = sets(city, cells, 2.0, 10.0), sets(city, cells, 0.5, 1.0)
    assert fine.sum() < 0.9 * coarse.sum()


def test_sets_grow_when_occluders_go():
    city = generated_city(4, seed=1)
    cells = street_cells(city, 4, seed=1)
    bounds = city.bounds()
    whole = sets(city, cells)
    kept = np.arange(len(city)) % 5 != 0
    fewer = sets(scene_of_boxes(bounds[kept], np.array(city.names)[kept].tolist()), cells)
    assert not (whole[:, kept] & ~fewer).any()
    assert fewer.sum() > whole[:, kept].sum()


@cache
def small_city():
    """With cells, and their sets."""
    city = generated_city(4, seed=2)
    cells = street_cells(city, 5, seed=2)
    return city, cells, sets(city, cells, 1.0)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_turning_the_scene_by_right_angles_turns_its_sets(turns):
    city, cells, plain = small_city()
    cosine, sine = round(np.cos(0.5 * np.pi * turns)), round(np.sin(0.5 * np.pi * turns))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def turned(low, high):
        ends = np.stack([low @ turn.T, high @ turn.T])
        return ends.min(axis=0), ends.max(axis=0)

    bounds = np.stack(turned(*city.bounds().transpose(1, 0, 2)), axis=1)
    there = ViewCells.boxes(*turned(cells.low, cells.high))
    assert np.array_equal(plain, sets(scene_of_boxes(bounds, list(city.names)), there, 1.0))


def test_the_order_of_objects_and_the_number_of_threads_say_nothing(monkeypatch):
    city = generated_city(4, seed=4)
    cells = street_cells(city, 6, seed=4)
    found = sets(city, cells, 1.0)
    order = np.random.default_rng(0).permutation(len(city))
    mixed = scene_of_boxes(city.bounds()[order], np.array(city.names)[order].tolist())
    assert np.array_equal(sets(mixed, cells, 1.0), found[:, order])
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    assert np.array_equal(sets(city, cells, 1.0), found)


def test_what_stands_in_a_cell_is_visible_and_hides_nothing():
    boxes = np.array([[(-2.0, 3.0, 0.0), (2.0, 7.0, 9.0)], [(-1.0, 30.0, 0.0), (1.0, 34.0, 5.0)]])
    scene = scene_of_boxes(boxes, ["wall", "behind"])
    cells = ViewCells.boxes(
        np.array([[-5.0, -5, 0], [-1.0, -5.0, 0.0]]), np.array([[5.0, 5, 2], [1.0, 2.5, 2.0]])
    )
    found = sets(scene, cells, 0.25, 0.5)
    assert named(scene, found[0]) == {"wall", "behind"}
    assert named(scene, found[1]) == {"wall"}


@cache
def on_a_ground(make, placing):
    """A city without its ground and with it, cells, and their sets without it."""
    city, whole = make()
    cells = street_cells(city, 4, seed=3)
    if placing == "triangles":
        cells = place_cells(UprightScene.of(city, "z"), "triangles", PvsOptions(up="z"))
        cells = cells.some(np.arange(0, len(cells), 180))
    return whole, cells, sets(city, cells, 1.0, 10.0)


@pytest.mark.parametrize(
    ("make", "ground"), [(city_on_a_slab, False), (city_on_a_slab, True), (city_on_terrain, True)]
)
@pytest.mark.parametrize("placing", ["boxes", "triangles"])
def test_a_ground_among_the_objects_hides_no_less_than_none(make, ground, placing):
    whole, cells, alone = on_a_ground(make, placing)
    found = sets(whole, cells, 1.0, 10.0, ground)
    assert found[:, -1].all()
    assert alone.mean() < 0.6
    # The ground itself hides feet of houses, and so no house more or less.
    assert np.array_equal(found[:, :-1], alone)


def test_a_wall_within_a_cell_that_is_lower_than_eyes_hides():
    boxes = np.array([[(-2.0, 3.0, 0.0), (2.0, 7.0, 1.0)], [(30.0, -40.0, 0.0), (34.0, 40.0, 9.0)],
                      [(60.0, -1.0, 0.0), (64.0, 1.0, 5.0)]])  # fmt: skip
    scene = scene_of_boxes(boxes, ["kerb", "wall", "behind"])
    assert named(scene, sets(scene, street_cell(), 0.25, 0.5)[0]) == {"kerb", "wall"}


@pytest.mark.parametrize("along", [0, 1])
def test_a_set_is_the_same_whatever_cells_are_looked_at_with_it(along):
    city = generated_city(4, seed=6)
    cells = street_cells(city, 6, size=7.0, seed=6)
    sizes = np.array([7.0, 2.3, 7.0, 4.0, 6.9999999999, 0.4])
    high = cells.high.copy()
    high[:, along] = cells.low[:, along] + sizes
    mixed = ViewCells.boxes(cells.low, high)
    together = sets(city, mixed, 1.0, 10.0)
    around = np.array([mixed.low[:, :2].min(axis=0), mixed.high[:, :2].max(axis=0)])
    maps = CullMaps(height_field(upright(city), 1.0, around), 10.0)
    for cell in range(len(mixed)):
        alone, _ = see_by_cull_maps(maps, mixed.some(np.array([cell])))
        assert np.array_equal(alone[0], together[cell])


def test_what_touches_a_cell_is_visible():
    boxes = np.array([[(5.0, -2.0, 0.0), (9.0, 2.0, 9.0)]])
    scene = scene_of_boxes(boxes, ["beside"])
    cells = ViewCells.boxes(np.array([[-5.0, -5.0, 0.0]]), np.array([[5.0, 5.0, 2.0]]))
    assert sets(scene, cells).all()


def slits(seed, turned=False, deep=7.0):
    """A thick wall with slits, a post behind each, and points that look straight through.

    A sample in the middle of an edge sees none of the posts, for it would have to look aslant.
    """
    random = np.random.default_rng(seed)
    middles = np.array([-3.9, -0.8, 2.6]) + random.uniform(-0.3, 0.3, 3)
    half = random.uniform(0.05, 0.15, 3)
    sides = np.stack([middles - half, middles + half], axis=1).ravel()
    ends = np.concatenate([[-15.0], sides, [15.0]]).reshape(-1, 2)  # past all lines to a post
    wall = [[(9.0, low, 0.0), (9.0 + deep, high, 20.0)] for low, high in ends]
    posts = [[(60.0, y - 0.1, 0.0), (60.2, y + 0.1, 9.0)] for y in middles]
    corners = np.array(wall + posts)
    points = np.column_stack([np.full(3, 5.0), middles, np.full(3, 2.0)])
    if turned:
        corners, points = corners[:, :, [1, 0, 2]], points[:, [1, 0, 2]]
    names = [f"wall {i}" for i in range(len(wall))] + [f"post {i}" for i in range(3)]
    return scene_of_boxes(corners, names), street_cell(), points


def missed_in_slits(pixels=(0.1, 0.3, 0.5, 0.9), spacing=10.0):
    """Proven objects that are not in the set, of 24 viewpoints in all."""
    missed = 0
    for seed in range(4):
        for turned in (False, True):
            scene, cells, points = slits(seed, turned)
            seen = proven(scene, points)
            assert seen[-3:].all()
            for pixel in pixels:
                missed += int((seen & ~sets(scene, cells, pixel, spacing)[0]).sum())
    return missed


def test_what_shows_through_slits_is_in_the_set():
    assert missed_in_slits() == 0


def shrink_less(monkeypatch, along, across):
    """Erode by so many pixels less, along the edges that samples stand for and across them."""
    whole = CullMaps.erosion

    def erosion(maps, window):
        lines = len(window.runs) // 2
        lines = max(lines - across, 0)
        middle = len(window.runs) // 2
        runs = window.runs[middle - lines : middle + lines + 1]
        less = tuple((min(first + along, 0), max(last - along, 0)) for first, last in runs)
        return whole(maps, Window(window.axis, less))

    monkeypatch.setattr(CullMaps, "erosion", erosion)


@pytest.mark.parametrize(("along", "across"), [(100, 100), (100, 0)])
def test_an_erosion_that_is_left_out_is_found_out(monkeypatch, along, across):
    shrink_less(monkeypatch, along, across)
    assert missed_in_slits((0.5, 0.9)) > 0


def two_slits():
    """A wall with slits opposite the ends of an edge, and posts far behind them."""
    wall = [[(9.0, -4.4, 0.0), (10.5, 4.4, 20.0)]]
    sides = [[(9.0, low, 0.0), (10.5, low + 30.0, 20.0)] for low in (4.6, -34.6)]
    posts = [[(600.0, low, 0.0), (600.5, low + 0.2, 9.0)] for low in (4.4, -4.6)]
    names = ["wall", "right", "left", "post right", "post left"]
    # A deep cell would have samples that stand for so much that the wall is nothing beside it.
    cell = ViewCells.boxes(np.array([[4.0, -5.0, 0.0]]), np.array([[5.0, 5.0, 2.0]]))
    return scene_of_boxes(np.array(wall + sides + posts), names), cell


@pytest.mark.parametrize(("less", "missed"), [(0, 0), (10, 2)])
def test_an_erosion_that_is_a_fifth_short_is_found_out(monkeypatch, less, missed):
    scene, cells = two_slits()
    seen = proven(scene, np.array([[5.0, y, 2.0] for y in (4.5, -4.5)]), 20_000)
    assert seen[-2:].all()
    shrink_less(monkeypatch, less, 0)
    assert (seen & ~sets(scene, cells, 0.1, 10.0)[0]).sum() == missed


def test_a_sample_that_is_left_out_is_found_out(monkeypatch):
    def fewer(*given):
        rows, kinds, free = _samples(*given)
        return rows[:1], kinds[:1], free

    monkeypatch.setattr("simplifier.visibility.cull_maps.cull_map._samples", fewer)
    assert missed_in_slits((0.1,), 2.5) > 0


@pytest.mark.parametrize("placing", ["boxes", "triangles"])
def test_a_close_look_at_what_a_quick_one_leaves_loses_nothing(placing):
    city = generated_city(5, seed=8)
    cells = street_cells(city, 6, seed=8)
    if placing == "triangles":
        cells = place_cells(UprightScene.of(city, "z"), "triangles", PvsOptions(up="z"))
        cells = cells.some(np.arange(0, len(cells), len(cells) // 6))
    around = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    field = height_field(upright(city), 1.0, around)
    quick, _ = see_by_cull_maps(CullMaps(field, 10.0), cells)
    close, work = see_by_cull_maps(CullMaps(field, 2.0), cells, wanted=quick)
    whole, most = see_by_cull_maps(CullMaps(field, 2.0), cells)
    assert not (close & ~quick).any()
    assert close.sum() < quick.sum()
    # A tile that is open shows what is looked at by itself to be hidden, or hides as well.
    assert close.sum() <= 1.01 * (whole & quick).sum()
    assert work[:, 0].sum() < 0.7 * most[:, 0].sum()
    for cell in range(len(cells)):
        seen = proven(city, viewpoints(cells, cell, 40, np.random.default_rng(cell)))
        assert not (seen & ~close[cell]).any()


def test_a_close_look_finds_what_shows_through_slits():
    for seed in range(4):
        scene, cells, points = slits(seed, seed % 2 == 1)
        around = np.array([cells.low[0, :2], cells.high[0, :2]])
        seen = proven(scene, points)[None]
        for pixel in (0.1, 0.5):
            maps = CullMaps(height_field(upright(scene), pixel, around), 2.0 * pixel)
            found, _ = see_by_cull_maps(maps, cells, wanted=np.ones_like(seen))
            assert not (seen & ~found).any()
