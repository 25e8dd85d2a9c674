"""A quick look by cull maps, then a close one at what it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.camera_paths.columns import UprightScene
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.cull_maps.by_cull_maps import _looks
from simplifier.visibility.cull_maps.cull_map import umbra_heights
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from simplifier.visibility.solid.terrain import Terrain
from tests.visibility.solid.test_terrain import terrain_of
from tests.visibility.test_find import city_and_cells


def town(blocks=5, count=12):
    upright, cells = city_and_cells(blocks, count, seed=8)
    return upright, cells, None


def mountains():
    random = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(33), np.arange(33))
    heights = 12.0 * np.sin(0.5 * x + 0.2 * y) + random.uniform(0.0, 2.0, x.shape)
    terrain: Terrain = terrain_of(heights, (10.0, 10.0), 4)
    upright = UprightScene.of(terrain.scene, "z")
    cells = place_on_terrain(terrain, upright, "grid", PvsOptions(up="z", cell_size=20.0))
    return upright, cells.some(np.arange(0, len(cells), 12)), terrain


def visible(pvs):
    return np.stack([pvs.visible(cell) for cell in range(len(pvs.cells))])


@pytest.mark.sweep(3)
@pytest.mark.parametrize(
    ("make", "fill"), [(town, "outside"), (town, "viewers"), (mountains, "outside")]
)
def test_the_close_look_takes_from_sets_what_is_hidden_alone(monkeypatch, make, fill):
    upright, cells, terrain = make()
    options = PvsOptions(up="z", epsilon=5.0, fill=fill)
    found = find_pvs(upright, cells, options, terrain=terrain)
    monkeypatch.setattr(
        "simplifier.visibility.cull_maps.by_cull_maps._looks", lambda *given: _looks(*given)[:1]
    )
    quick = find_pvs(upright, cells, options, terrain=terrain)
    assert not (visible(found.pvs) & ~visible(quick.pvs)).any()
    assert visible(found.pvs).sum() < 0.98 * visible(quick.pvs).sum()
    check = check_pvs(
        upright.scene, found.pvs, CheckOptions(cells=len(cells), views=20), terrain=terrain
    )
    assert not check.leaks
    # The umbra of the pictures is that of the closer look.
    near, far = (umbra_heights(each.maps, cells, 0) for each in (found, quick))
    assert (near > far).mean() > 2.0 * (near < far).mean()


def test_a_set_depends_on_no_other_cell_no_batch_and_no_thread(monkeypatch):
    upright, cells, _ = town(3, 8)
    options = PvsOptions(up="z", epsilon=2.5)
    whole = visible(find_pvs(upright, cells, options).pvs)
    monkeypatch.setattr("simplifier.visibility.cull_maps.by_cull_maps._BATCH", 3)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    assert np.array_equal(visible(find_pvs(upright, cells, options).pvs), whole)
    back = find_pvs(upright, cells.some(np.arange(len(cells))[::-1]), options).pvs
    assert np.array_equal(visible(back)[::-1], whole)


def test_opengl_takes_the_quick_look_alone():
    upright, cells, _ = town(2, 1)
    field = find_pvs(upright, cells, PvsOptions(up="z", epsilon=2.5)).maps.field
    quick, close = _looks(field, PvsOptions(up="z", epsilon=2.5))
    assert (quick.half, close.half) == (5.0, 1.0)
    assert len(_looks(field, PvsOptions(up="z", backend="opengl"))) == 1
