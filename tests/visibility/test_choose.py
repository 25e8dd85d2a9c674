"""What ``--method auto`` takes, why, and that nothing hangs on a clock."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import MemoryLimitError
from simplifier.geometry.elevation import Elevation
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility import choose, find
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.choose import BOTH, CULL_MAP, SLICES, STRONG, TERRAIN, places_in
from simplifier.visibility.find import find_pvs, settings_digest
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from simplifier.visibility.scene_input import SceneInput
from simplifier.visibility.solid.terrain import Terrain

OPTIONS = PvsOptions(up="z", epsilon=2.5)


@pytest.fixture(scope="module")
def town():
    city = generated_city(3)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, 24)
    return upright, ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)


@pytest.fixture(scope="module")
def found(town):
    """Its sets by each method that never leaves anything out, and by what auto takes."""
    return {
        method: find_pvs(*town, replace(OPTIONS, method=method))
        for method in ("auto", "cull-map", "strong")
    }


def sets(pvs):
    return np.array([pvs.visible(cell) for cell in pvs.computed.tolist()])


def rooms(storeys=2):
    """Closed rooms of slabs and walls, one behind the other, and a thing in each."""
    parts, cells = [], []
    for storey in range(storeys):
        z = 3.0 * storey
        parts.append([(0.0, 0.0, z), (20.0, 4.0, z + 0.2)])
        for room in range(6):
            x = 4.0 * room
            parts.append([(x - 0.2, 0.0, z + 0.2), (x, 4.0, z + 3.0)])
            if room < 5:
                parts += [[(x, 0.0, z + 0.2), (x + 3.8, 0.2, z + 3.0)],
                          [(x, 3.8, z + 0.2), (x + 3.8, 4.0, z + 3.0)],
                          [(x + 2.0, 1.0, z + 0.2), (x + 2.5, 1.5, z + 0.7)]]  # fmt: skip
                cells.append([(x + 0.5, 1.0, z + 0.3), (x + 1.5, 2.0, z + 1.9)])
    parts.append([(0.0, 0.0, 3.0 * storeys), (20.0, 4.0, 3.0 * storeys + 0.2)])
    scene = scene_of_boxes(np.array(parts), [f"part {i}" for i in range(len(parts))])
    upright = UprightScene.of(scene, "z")
    places = np.array(cells) - upright.origin
    return upright, ViewCells.boxes(places[:, 0], places[:, 1])


def test_both_methods_of_a_town_leave_no_more_than_either(town, found):
    auto, maps, strong = (sets(found[name].pvs) for name in ("auto", "cull-map", "strong"))
    assert found["auto"].way == BOTH
    assert not (auto & ~(maps & strong)).any()
    assert auto.sum() < 0.99 * maps.sum()
    assert auto.sum() < 0.9 * strong.sum()
    check = check_pvs(town[0].scene, found["auto"].pvs, CheckOptions(24, 30))
    assert not check.leaks
    assert found["auto"].pvs.conservative
    assert "after strong occluders, since 100 %" in found["auto"].reason
    assert "14.2 wide" in found["auto"].reason.partition("objects are convex")[2]


def test_wide_cells_and_what_is_not_convex_take_cull_maps_alone(town):
    upright, cells = town
    wide = ViewCells.boxes(cells.low[:1], cells.high[:1] + np.array([4.0, 4.0, 0.0]))
    options = replace(OPTIONS, skip_buried=True)
    assert "(cells: 14)" in find_pvs(upright, wide, options).reason
    vertices = np.array([[0.0, 0, 0], [60, 0, 0], [60, 60, 0], [20, 10, 0]])
    ring = np.concatenate([vertices, vertices + np.array([0, 0, 9.0])])
    sides = [[i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4)]
    faces = [[a, b, c] for a, b, c, _ in sides] + [[a, c, d] for a, _, c, d in sides]
    faces += [[3, 1, 0], [3, 2, 1], [7, 4, 5], [7, 5, 6]]
    mesh = TriangleMesh.from_soup(ring, np.array(faces))
    bent = Scene((mesh,), ("bent",), np.zeros(1, np.int32), np.eye(4)[None])
    some = ViewCells.boxes(np.array([[5.0, 40, 0]]), np.array([[9.0, 44, 2]]))
    one = find_pvs(UprightScene.of(bent, "z"), some, OPTIONS)
    assert one.way == CULL_MAP
    assert "only 0 % of the objects are convex" in one.reason


def test_what_only_cull_maps_have_takes_them(town):
    upright, cells = town
    filled = find_pvs(upright, cells.some(np.arange(1)), replace(OPTIONS, fill="viewers"))
    assert filled.way == CULL_MAP


@cache
def ridges():
    """Hills in 8 x 8 tiles of 40."""
    x, y = np.meshgrid(np.arange(33), np.arange(33))
    heights = 30.0 * np.sin(0.4 * x) * np.cos(0.3 * y)
    terrain = Terrain.of(Elevation(heights, (10.0, 10.0), (0.0, 0.0)), 4)
    return terrain, UprightScene.of(terrain.scene, "z")


def test_cells_as_wide_as_the_tiles_of_a_terrain_take_voxel_columns_and_are_the_tiles():
    terrain, upright = ridges()
    options = PvsOptions(up="z", cell_size=50.0)
    asked = SceneInput(terrain.scene, None, terrain).with_cells("grid", options)
    assert len(asked.cells) == len(terrain.scene) == 64
    one = find_pvs(upright, asked.cells, options, terrain=terrain)
    assert one.way == TERRAIN
    assert one.reason == "since it is a terrain, and cells are 40 wide, its tiles 40"
    columns = find_pvs(
        upright, asked.cells, replace(options, method="voxel-column"), terrain=terrain
    )
    maps = find_pvs(upright, asked.cells, replace(options, method="cull-map"), terrain=terrain)
    assert np.array_equal(sets(one.pvs), sets(columns.pvs))
    assert sets(one.pvs).sum() < sets(maps.pvs).sum()
    assert not check_pvs(terrain.scene, one.pvs, CheckOptions(8, 20), terrain=terrain).leaks


@pytest.mark.parametrize(
    ("changed", "some", "reason"),
    [
        ({"cell_size": 26.0}, 64, "and cells are 26 wide, its tiles 40"),
        ({}, 15, "and its 64 tiles are many for so few cells"),
        ({"time_limit": 60.0}, 64, "one height at each place"),
        ({"epsilon": 20.0}, 64, "one height at each place"),
    ],
)
def test_cull_maps_are_kept_where_voxel_columns_lose_on_a_terrain(changed, some, reason):
    terrain, upright = ridges()
    options = PvsOptions(**{"up": "z", "cell_size": 40.0, **changed})
    cells = place_on_terrain(terrain, upright, "grid", options)
    one = find_pvs(upright, cells.some(np.arange(some)), options, terrain=terrain)
    assert one.way == CULL_MAP
    assert one.reason.endswith(reason)


def test_cells_beyond_a_terrain_take_cull_maps():
    terrain, upright = ridges()
    options = PvsOptions(up="z", cell_size=40.0)
    cells = place_on_terrain(terrain, upright, "grid", options)
    beyond = ViewCells.boxes(cells.low - np.array([5.0, 0.0, 0.0]), cells.high)
    assert find_pvs(upright, beyond, options, terrain=terrain).way == CULL_MAP


def test_rooms_take_slices_where_these_leave_half_as_much_and_are_told_not_to_be_sure():
    upright, cells = rooms()
    options = PvsOptions(up="z", epsilon=1.0, cell_size=1.0)
    one = find_pvs(upright, cells, options)
    strong = find_pvs(upright, cells, replace(options, method="strong"))
    slices = find_pvs(upright, cells, replace(options, method="slice-wise"))
    halved = sets(slices.pvs).sum() <= 0.5 * sets(strong.pvs).sum()
    assert one.way == (SLICES if halved else STRONG)
    assert "cells are on several storeys" in one.reason
    assert np.array_equal(sets(one.pvs), sets((slices if halved else strong).pvs))
    assert one.pvs.conservative is not halved
    assert one.cost.cells >= len(cells) - 1


def test_what_floats_takes_strong_occluders_unless_slices_serve():
    generator = np.random.default_rng(0)
    middles = generator.uniform(0.0, 4000.0, (40, 3))
    corners = np.stack([middles - 20.0, middles + 20.0], axis=1)
    scene = scene_of_boxes(corners, [f"{i}" for i in range(40)])
    upright = UprightScene.of(scene, "z")
    cell = ViewCells.boxes(np.full((1, 3), 2000.0), np.full((1, 3), 2010.0))
    one = find_pvs(upright, cell, PvsOptions(up="z"))
    assert one.way == STRONG
    assert "is solid from the ground up, and slices would take too many voxels" in one.reason


def test_a_file_keeps_its_method(town, found):
    upright, cells = town
    some, more = (cells.some(np.arange(count)) for count in (6, 10))
    for method, way in (("cull-map", CULL_MAP), ("strong", STRONG), ("auto", BOTH)):
        part = find_pvs(upright, some, replace(OPTIONS, method=method)).pvs
        on = find_pvs(upright, more, OPTIONS, part)
        assert (on.way, on.made) == (way, 4)
        assert np.array_equal(sets(on.pvs), sets(found[method].pvs)[:10])
        assert on.pvs.settings == part.settings == settings_digest(OPTIONS, way)
        assert "as are those in the file" in on.reason
    assert find_pvs(upright, some, replace(OPTIONS, method="cull-map"), part).made == 6
    assert find_pvs(upright, some, replace(OPTIONS, epsilon=2.0), part).made == 6
    assert len({settings_digest(OPTIONS, way) for way in choose.WAYS}) == len(choose.WAYS)


def test_too_little_memory_for_a_raster_leaves_strong_occluders(town, monkeypatch):
    def refuse(task):
        raise MemoryLimitError("too much")

    monkeypatch.setitem(find.METHODS, "cull-map", refuse)
    upright, cells = town
    one = find_pvs(upright, cells.some(np.arange(2)), OPTIONS)
    assert one.way == STRONG
    assert "raster" in one.reason


def test_cells_that_the_second_method_leaves_out_keep_their_places(town):
    _, cells = town
    places = places_in(cells, cells.some(np.array([3, 9, 20])))
    assert places.tolist() == [3, 9, 20]


def test_what_hides_nothing_at_all(town):
    upright, cells = town
    nothing = replace(
        upright.scene, names=(), mesh_of=upright.scene.mesh_of[:0],
        transforms=upright.scene.transforms[:0],
    )  # fmt: skip
    one = find_pvs(upright, cells.some(np.arange(2)), OPTIONS, opaque=nothing)
    assert one.way == CULL_MAP
    assert sets(one.pvs).all()
