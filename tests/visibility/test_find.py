"""Sets of a whole scene: kept, gone on with, refused, and never believed of another scene."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import CancelledError, OptionError
from simplifier.geometry.pvs import UNKNOWN
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import Watch, find_pvs, scene_digest, settings_digest

OPTIONS = PvsOptions(up="z", epsilon=2.5)


def city_and_cells(blocks=4, count=40, seed=0):
    """A city upright, and cells in its streets in the space of its origin."""
    city = generated_city(blocks, seed)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, count, seed=seed)
    return upright, ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)


def test_the_sets_hold_all_that_is_certainly_seen():
    upright, cells = city_and_cells()
    found = find_pvs(upright, cells, OPTIONS)
    assert found.made == len(cells)
    assert not found.warnings
    check = check_pvs(upright.scene, found.pvs, CheckOptions(cells=20, views=20))
    assert not check.leaks
    assert check.excess < 2.0
    assert check.proven_share > 0.5


@pytest.mark.parametrize("up", ["x", "y"])
def test_any_axis_is_up_and_map_coordinates_keep_their_digits(up):
    upright, cells = city_and_cells(3, 6)
    axis = "xyz".index(up)
    turn = np.zeros((4, 4))
    turn[[(axis + 1) % 3, (axis + 2) % 3, axis, 3], [0, 1, 2, 3]] = 1.0
    turn[:3, 3] = [4e6, 5e6, 300.0]
    scene = upright.scene
    there = Scene(scene.meshes, scene.names, np.array(scene.mesh_of), turn @ scene.transforms)
    far = UprightScene.of(there, up)
    found = find_pvs(far, cells, PvsOptions(up=up, epsilon=2.5)).pvs
    near = find_pvs(upright, cells, OPTIONS).pvs
    for cell in range(len(cells)):
        assert np.array_equal(found.visible(cell), near.visible(cell))
    middle = np.ones(4)
    middle[:3] = 0.5 * (cells.low[0] + cells.high[0]) + upright.origin
    assert np.array_equal(found.visible((turn @ middle)[:3]), near.visible(0))


def test_another_cell_costs_that_cell_alone():
    upright, cells = city_and_cells(2, 12)
    first = find_pvs(upright, cells.some(np.arange(8)), OPTIONS)
    both = find_pvs(upright, cells, OPTIONS, first.pvs)
    assert both.made == len(cells) - 8
    fresh = find_pvs(upright, cells, OPTIONS).pvs
    assert fresh.rows.data == both.pvs.rows.data
    assert np.array_equal(fresh.row_of, both.pvs.row_of)
    assert find_pvs(upright, cells, OPTIONS, both.pvs).made == 0
    other = PvsOptions(up="z", epsilon=5.0)
    assert find_pvs(upright, cells, other, both.pvs).made == len(cells)
    bounds = upright.scene.bounds()
    bounds[0, 1, 2] += 1.0
    changed = UprightScene.of(scene_of_boxes(bounds, list(upright.scene.names)), "z")
    assert find_pvs(changed, cells, OPTIONS, both.pvs).made == len(cells)


def test_what_is_left_sees_everything_and_is_made_later():
    upright, cells = city_and_cells(3, 40)
    cancel = threading.Event()

    def stop(done, total):
        assert total == len(cells)
        if done:
            cancel.set()

    part = find_pvs(upright, cells, OPTIONS, None, Watch(tell=stop, cancel=cancel))
    assert 0 < part.made < len(cells)
    assert part.pvs.partial
    assert "see everything" in part.warnings[-1]
    left = np.flatnonzero(part.pvs.row_of == UNKNOWN)
    assert part.pvs.visible(int(left[0])).all()
    rest = find_pvs(upright, cells, OPTIONS, part.pvs)
    assert rest.made == len(left)
    assert not rest.pvs.partial


def test_heights_are_told_of_and_can_be_cancelled():
    upright, cells = city_and_cells(3, 2)
    told, cancel = [], threading.Event()

    def hear(done, total):
        told.append((done, total))
        cancel.set()

    found = find_pvs(
        upright, cells, OPTIONS, None, Watch(tell_objects=lambda *some: told.append(some))
    )
    assert found.made == 2
    assert set(told) == {(0, len(upright.scene))}
    with pytest.raises(CancelledError):
        find_pvs(upright, cells, OPTIONS, None, Watch(cancel=cancel, tell_objects=hear))


def test_nothing_done_is_an_end():
    upright, cells = city_and_cells(2, 4)
    cancel = threading.Event()
    cancel.set()
    with pytest.raises(CancelledError):
        find_pvs(upright, cells, OPTIONS, None, Watch(cancel=cancel))


def test_a_cell_in_a_building_is_refused_by_name_or_skipped():
    upright, cells = city_and_cells(3, 4)
    low, high = upright.boxes[5]
    middle = 0.5 * (low + high)
    middle[2] = 0.0
    size = np.array([1.0, 1.0, 2.0])
    inside = ViewCells.boxes((middle - [1.0, 1.0, 0.0])[None], (middle + size)[None])
    both = ViewCells.joined(cells, inside)
    with pytest.raises(OptionError, match=f"cell {len(cells)} lies wholly within 'block"):
        find_pvs(upright, both, OPTIONS)
    skipped = find_pvs(upright, both, PvsOptions(up="z", epsilon=2.5, skip_buried=True))
    assert len(skipped.pvs.cells) == len(cells)
    with pytest.raises(OptionError, match="all of them"):
        find_pvs(upright, inside, PvsOptions(up="z", epsilon=2.5, skip_buried=True))


def test_an_epsilon_that_is_too_fine_is_refused_with_the_least():
    upright, cells = city_and_cells(4, 2)
    with pytest.raises(OptionError, match=r"choose 0\.0\d+ or more"):
        find_pvs(upright, cells, PvsOptions(up="z", epsilon=0.001))


def test_thin_occluders_and_open_ones_are_told():
    walls = [[(6.0 * i, 0.0, 0.0), (6.0 * i + 1.0, 60.0, 9.0)] for i in range(8)]
    scene = scene_of_boxes(np.array(walls), [f"wall {i}" for i in range(8)])
    upright = UprightScene.of(scene, "z")
    cells = ViewCells.boxes(np.array([[2.0, 2, 0]]), np.array([[4.0, 4, 2]]))
    found = find_pvs(upright, cells, PvsOptions(up="z", epsilon=2.0))
    assert "thinner than twice an epsilon of 2" in found.warnings[0]
    least = float(found.warnings[0].rpartition(" ")[2])
    assert find_pvs(upright, cells, PvsOptions(up="z", epsilon=least)).pvs.visible(0).sum() < 8
    floating = np.array(walls)
    floating[1:, 0, 2] = 3.0
    over = UprightScene.of(scene_of_boxes(floating, [f"wall {i}" for i in range(8)]), "z")
    (told,) = find_pvs(over, cells, replace(OPTIONS, method="cull-map")).warnings
    assert told.startswith("82 % of what stands in the scene is not solid from the ground up")
    assert told.endswith("try --ground, or --method slice-wise")


def test_digests_tell_scenes_and_settings_apart():
    city = generated_city(2)
    moved = scene_of_boxes(city.bounds() + 1.0, list(city.names))
    renamed = scene_of_boxes(city.bounds(), [f"{name}!" for name in city.names])
    assert len({scene_digest(each) for each in (city, moved, renamed)}) == 3
    some = [PvsOptions(), PvsOptions(epsilon=1.0), PvsOptions(up="z"), PvsOptions(ground=True)]
    assert len({settings_digest(each) for each in some}) == 4
    assert settings_digest(PvsOptions(eye_height=2.0)) == settings_digest(PvsOptions())
