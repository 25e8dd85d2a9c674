"""Cull maps over a terrain: nothing that exact lines see is missing, and ridges hide valleys."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.pvs import pack_rows
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs, viewpoints
from simplifier.visibility.checking.terrain_view import terrain_seen_from
from simplifier.visibility.cull_maps.cull_map import CullMaps, _reaching, see_by_cull_maps
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from simplifier.visibility.solid.terrain import terrain_field
from tests.visibility.cull_maps.test_cull_map import shrink_less
from tests.visibility.solid.test_terrain import terrain_of


def sets(terrain, cells, pixel, spacing):
    """(c, n) what each cell may see; cells in the upright space of the terrain."""
    upright = UprightScene.of(terrain.scene, "z")
    plan = np.array([cells.low[:, :2].min(axis=0), cells.high[:, :2].max(axis=0)])
    field = terrain_field(terrain, upright, pixel, plan)
    return see_by_cull_maps(CullMaps(field, spacing), cells)[0]


def on_terrain(terrain, size, eye=1.0):
    upright = UprightScene.of(terrain.scene, "z")
    options = PvsOptions(up="z", cell_size=size, eye_height=eye)
    return upright, place_on_terrain(terrain, upright, "grid", options)


def seen(terrain, upright, cells, cell, count, seed):
    """(n,) what points of a cell certainly see."""
    places = viewpoints(cells, cell, count, np.random.default_rng(seed)) + upright.origin
    return ~np.isnan(terrain_seen_from(terrain, places, 360)).all(axis=0)


def hills(seed, size=33):
    """Rough ground with ridges."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    ridges = 6.0 * np.sin(0.5 * x + 0.2 * y) + 4.0 * np.cos(0.4 * y - 0.1 * x)
    return ridges + random.uniform(0.0, 2.0, (size, size))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("mirrored", [False, True])
def test_all_that_any_point_of_a_cell_sees_is_in_its_set_split_either_way(seed, mirrored):
    heights = hills(seed)
    terrain = terrain_of(heights, (5.0, 4.0), 4)
    upright, cells = on_terrain(terrain, 9.0)
    some = np.random.default_rng(seed).choice(len(cells), 12, replace=False)
    found = sets(terrain, cells.some(some), 0.9, 4.5)
    # Seen in a mirror each square is split along its other diagonal.
    mirror = terrain_of(heights[:, ::-1], (5.0, 4.0), 4) if mirrored else terrain
    order = [name.split("_") for name in terrain.scene.names]
    places = [int(row) * 8 + (7 - int(column) if mirrored else int(column))
              for _, row, column in order]  # fmt: skip
    for row, cell in zip(found, some, strict=True):
        points = viewpoints(cells, cell, 24, np.random.default_rng(seed)) + upright.origin
        if mirrored:
            points[:, 0] = 160.0 - points[:, 0]
        known = ~np.isnan(terrain_seen_from(mirror, points, 360)).all(axis=0)[places]
        assert not (known & ~row).any()
        assert known.sum() > 5
    assert found.mean() < 0.8


def test_a_valley_behind_a_ridge_is_in_no_set_of_the_other_side():
    heights = np.zeros((33, 65))
    heights[:, 30] = 60.0
    terrain = terrain_of(heights, (10.0, 10.0), 8)
    _, cells = on_terrain(terrain, 20.0, 2.0)
    west = cells.high[:, 0] < 280.0
    east = np.array([int(name.split("_")[2]) >= 4 for name in terrain.scene.names])
    found = sets(terrain, cells.some(np.flatnonzero(west)[::14]), 2.0, 10.0)
    assert not found[:, east].any()
    assert found[:, ~east].mean() > 0.9


@pytest.mark.parametrize(("less", "found_out"), [(0, False), (100, True)])
def test_an_erosion_that_is_left_out_is_found_out(monkeypatch, less, found_out):
    """Through a notch in a wall each end of the cell sees what no sample does."""
    shrink_less(monkeypatch, less, less)
    heights = np.zeros((41, 61))
    heights[:, 20:22] = 30.0
    heights[20:22, 20:22] = 0.0
    terrain = terrain_of(heights, tile=2)
    upright = UprightScene.of(terrain.scene, "z")
    floor = -upright.origin[2]
    cell = ViewCells.boxes(np.array([[3.0, 10.0, floor]]), np.array([[13.0, 30.0, floor + 2.0]]))
    row = sets(terrain, cell, 0.5, 20.0)[0]
    known = seen(terrain, upright, cell, 0, 100, 0)
    assert ((known & ~row).sum() > 0) == found_out


def test_a_cell_cut_into_a_hill_is_not_hidden_by_what_is_in_it():
    heights = np.zeros((21, 41))
    heights[:, 9:12] = 12.0
    terrain = terrain_of(heights, (2.0, 2.0), 4)
    upright = UprightScene.of(terrain.scene, "z")
    floor = -upright.origin[2]
    # The hill is at x from 16 to 24: the first cell holds it, and ends below its top.
    low = np.array([[10.0, 10.0, floor], [0.0, 10.0, floor]])
    high = np.array([[30.0, 30.0, floor + 3.0], [10.0, 30.0, floor + 3.0]])
    cells = ViewCells.boxes(low, high)
    found = sets(terrain, cells, 0.5, 2.0)
    sides = [seen(terrain, upright, cells, cell, 80, 0) for cell in (0, 1)]
    assert not (sides[0] & ~found[0]).any()
    assert not (sides[1] & ~found[1]).any()
    far = np.array([int(name.split("_")[2]) >= 4 for name in terrain.scene.names])
    assert found[0][far].all()
    assert not found[1][far].any()


def test_only_pixels_as_high_as_the_cell_are_taken_off():
    heights = np.zeros((9, 9))
    heights[4, 3:6] = 8.0
    terrain = terrain_of(heights, (4.0, 4.0), 4)
    upright, cells = on_terrain(terrain, 16.0)
    plan = np.array([np.zeros(2), upright.extent[:2]])
    field = terrain_field(terrain, upright, 0.5, plan)
    for cell in range(len(cells)):
        assert len(_reaching(field, cells.low[cell], cells.high[cell], 4)) == 0
    top = float(np.float32(4.0 - upright.origin[2]))
    taken = _reaching(field, np.array([4.0, 4.0, 0.0]), np.array([28.0, 28.0, top]), 4)
    covered = np.zeros(field.shape, dtype=bool)
    for x0, x1, y0, y1 in taken:
        covered[x0 : x1 + 1, y0 : y1 + 1] = True
    within = slice(1, -2), slice(1, -2)  # not beyond the terrain
    assert np.array_equal(covered[within], field.inner[within] >= top)
    assert covered.any()


def test_tiles_with_missing_samples_are_in_every_set():
    heights = np.zeros((17, 33))
    heights[:, 13:16] = 40.0
    heights[2, 30] = np.nan
    terrain = terrain_of(heights, (5.0, 5.0), 4)
    upright, cells = on_terrain(terrain, 10.0)
    pvs = find_pvs(upright, cells, PvsOptions(up="z", cell_size=10.0), terrain=terrain).pvs
    holed = terrain.scene.names.index("tile_0_7")
    below = terrain.scene.names.index("tile_2_7")
    rows = np.array([pvs.visible(cell) for cell in range(len(cells))])
    assert rows[:, holed].all()
    assert not rows[cells.high[:, 0] < 60.0, below].any()
    check = check_pvs(
        terrain.scene, pvs, CheckOptions(cells=8, views=20, pictures=2, pixels=128),
        terrain=terrain,
    )  # fmt: skip
    assert not check.leaks
    blind = check_pvs(terrain.scene, empty(pvs), CheckOptions(cells=2, views=9), terrain=terrain)
    assert {leak.proof for leak in blind.leaks} == {"line"}


def empty(pvs):
    """The same cells, from which nothing is visible."""
    rows, places = pack_rows([np.zeros(len(pvs.names), bool)] * len(pvs.cells))
    return replace(pvs, rows=rows, row_of=places)
