"""Sets by voxel columns: what cells have of their columns' horizons, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import CancelledError, MemoryLimitError, OptionError
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.columns import by_voxel_columns
from simplifier.visibility.columns.by_voxel_columns import post_size
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_columns, place_on_terrain
from tests.visibility.columns.test_horizons import rough
from tests.visibility.cull_maps.test_cull_map_terrain import hills
from tests.visibility.scenes import one_box
from tests.visibility.solid.test_terrain import terrain_of

OPTIONS = PvsOptions(up="z", method="voxel-column", eye_height=1.0)


def made(heights, spacing=(5.0, 4.0), tile=4, **chosen):
    terrain = terrain_of(heights, spacing, tile, (1000.0, 2000.0))
    upright = UprightScene.of(terrain.scene, "z")
    return terrain, upright, replace(OPTIONS, **chosen)


def test_sets_have_no_leaks_and_altitudes_make_them_smaller_from_below():
    terrain, upright, options = made(3.0 * hills(1))
    cells = place_columns(terrain, upright, "grid", options)
    found = find_pvs(upright, cells, options, terrain=terrain).pvs
    assert (found.method, found.conservative) == ("voxel-column", True)
    assert len(cells) == len(terrain.scene) == 64
    check = check_pvs(terrain.scene, found, CheckOptions(20, 30, 120), terrain=terrain)
    assert check.leaks == ()
    assert check.culled_share > 0.05
    fewer = 0
    for cell in range(len(cells)):
        low, high = cells.low[cell], cells.high[cell]
        middle = 0.5 * (low + high)[:2]
        at_top = found.visible(np.array([*middle, high[2]]) + found.origin)
        assert np.array_equal(at_top, found.visible(cell))
        below = found.visible(np.array([*middle, low[2] + 0.1]) + found.origin)
        assert not (below & ~at_top).any()
        fewer += (at_top & ~below).sum()
    assert fewer > 100
    beyond = np.array([*middle, high[2] + 1.0]) + found.origin
    assert found.visible(beyond).all()


def test_cells_of_any_size_have_the_lowest_of_the_altitudes_of_their_columns():
    terrain, upright, options = made(rough(4, 33), cell_size=13.0)
    columns = place_columns(terrain, upright, "grid", options)
    squares = place_on_terrain(terrain, upright, "grid", options)
    whole = find_pvs(upright, columns, options, terrain=terrain).pvs
    pvs = find_pvs(upright, squares, options, terrain=terrain).pvs
    assert whole.altitudes is not None
    assert pvs.altitudes is not None
    assert pvs.altitudes.step == pytest.approx(whole.altitudes.step, rel=0.1)
    whole_altitudes = whole.altitudes.counted(pvs.altitudes.low, pvs.altitudes.step).values
    for cell in range(len(squares)):
        over = (columns.low[:, :2] < squares.high[cell, :2]) & (
            columns.high[:, :2] > squares.low[cell, :2]
        )
        known = whole_altitudes[over.all(axis=1)].min(axis=0).astype(int)
        assert np.abs(pvs.altitudes.values[cell].astype(int) - known).max() <= 2
    check = check_pvs(terrain.scene, pvs, CheckOptions(10, 20, 90), terrain=terrain)
    assert check.leaks == ()


def test_sets_are_kept_and_an_epsilon_is_whole_posts():
    terrain, upright, options = made(rough(5), tile=8)
    cells = place_columns(terrain, upright, "grid", options)
    first = find_pvs(upright, cells, options, terrain=terrain)
    again = find_pvs(upright, cells, options, first.pvs, terrain=terrain)
    assert (first.made, again.made) == (len(cells), 0)
    assert again.pvs.altitudes is not None
    assert np.array_equal(again.pvs.altitudes.values, first.pvs.altitudes.values)
    coarse = replace(options, epsilon=11.0)
    assert [post_size(terrain, replace(options, epsilon=e)) for e in (None, 0.1, 11.0, 1e9)] == [
        1, 1, 2, 4,
    ]  # fmt: skip
    other = find_pvs(upright, cells, coarse, first.pvs, terrain=terrain)
    assert other.made == len(cells)
    check = check_pvs(terrain.scene, other.pvs, CheckOptions(9, 20, 90), terrain=terrain)
    assert check.leaks == ()


def test_what_is_no_elevation_model_is_refused_with_a_method_that_serves():
    scene = one_box().scene
    upright = UprightScene.of(scene, "z")
    cells = ViewCells.boxes(np.zeros((1, 3)), np.ones((1, 3)))
    with pytest.raises(OptionError, match="overhangs of a mesh would be lost") as caught:
        find_pvs(upright, cells, OPTIONS)
    assert "cull-map" in str(caught.value)
    assert "slice-wise" in str(caught.value)


@pytest.mark.parametrize("chosen", [{"fill": "viewers"}, {"backend": "opengl"}])
def test_what_only_cull_maps_have_is_refused(chosen):
    terrain, upright, options = made(rough(0), **chosen)
    cells = place_columns(terrain, upright, "grid", options)
    with pytest.raises(OptionError, match=f"voxel columns have no --{next(iter(chosen))}"):
        find_pvs(upright, cells, options, terrain=terrain)


def test_cells_beyond_the_terrain_and_too_little_memory_or_time_are_refused():
    terrain, upright, options = made(rough(0))
    cells = place_columns(terrain, upright, "grid", options)
    outside = ViewCells.boxes(cells.low - [1.0, 0.0, 0.0], cells.high)
    with pytest.raises(OptionError, match="cell 0 reaches beyond the terrain"):
        find_pvs(upright, outside, options, terrain=terrain)
    with pytest.raises(MemoryLimitError, match="choose larger tiles"):
        find_pvs(upright, cells, replace(options, memory_limit=1e-3), terrain=terrain)
    with pytest.raises(CancelledError):
        find_pvs(upright, cells, replace(options, time_limit=1e-9), terrain=terrain)


def test_columns_stand_on_their_tiles_from_the_lowest_ground_to_an_eye_over_the_highest():
    terrain, upright, options = made(rough(6, 11))
    cells = place_columns(terrain, upright, "grid", options)
    for number, cell in zip(terrain.numbers.ravel(), range(len(cells)), strict=True):
        box = upright.boxes[number]
        surface = terrain.scene.meshes[number].vertices[:, 2]
        assert cells.low[cell, :2] == pytest.approx(box[0, :2], abs=1e-3)
        assert cells.high[cell, :2] == pytest.approx(box[1, :2], abs=1e-3)
        assert cells.high[cell, 2] == pytest.approx(surface.max() - upright.origin[2] + 1.0)
    with pytest.raises(OptionError, match="choose walkable or grid"):
        place_columns(terrain, upright, "floors", options)


def test_sweeps_are_made_once_for_all_cells_and_never_for_none(monkeypatch):
    terrain, upright, options = made(rough(5), tile=8)
    cells = place_columns(terrain, upright, "grid", options)
    asked = []
    real = by_voxel_columns.horizons
    monkeypatch.setattr(
        by_voxel_columns, "horizons", lambda *some: asked.append(len(some)) or real(*some)
    )
    first = find_pvs(upright, cells, options, terrain=terrain)
    assert len(asked) == 1
    assert first.foretold is not None  # a few cells were looked from before the others
    find_pvs(upright, cells, options, first.pvs, terrain=terrain)
    assert len(asked) == 1
