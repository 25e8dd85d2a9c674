"""Sets by strong occluders: nothing visible is left out, for cells of any kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.errors import OptionError
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import find_pvs
from simplifier.visibility.method import Task
from simplifier.visibility.placing.cells import place_cells
from simplifier.visibility.strong.by_strong_occluders import by_strong_occluders
from tests.visibility.rooms import bent_hall
from tests.visibility.scenes import PUZZLES

OPTIONS = PvsOptions(up="z", method="strong", cell_size=5.0)


def found_in(scene, cells, options=OPTIONS):
    upright = UprightScene.of(scene, options.up)
    low, high = cells.low - upright.origin, cells.high - upright.origin
    return find_pvs(upright, ViewCells.boxes(low, high), options)


def named(pvs, cell=0):
    return {name for name, seen in zip(pvs.names, pvs.visible(cell), strict=True) if seen}


def test_no_leak_in_a_city():
    city = generated_city(5)
    found = found_in(city, street_cells(city, 40, 5.0))
    assert found.pvs.method == "strong-occluders"
    assert found.pvs.conservative
    assert not found.warnings
    check = check_pvs(city, found.pvs, CheckOptions(cells=25, views=30))
    assert not check.leaks
    assert check.excess < 1.6


def test_what_another_method_looks_at_again_is_looked_at_in_haste():
    """Closer looks hide more; without them nothing is hidden that they would have shown."""
    city = generated_city(6)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, 40, 5.0)
    cells = ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)
    task = Task(upright, cells, OPTIONS, None, None, lambda *_: None)
    every = np.arange(len(cells))
    with by_strong_occluders(task) as close:
        near = close.see(every).visible
    with by_strong_occluders(replace(task, looked_at_again=True)) as hasty:
        far = hasty.see(every).visible
    assert not (near & ~far).any()
    assert near.sum() < far.sum() < 1.2 * near.sum()


def test_no_leak_from_triangles_of_free_space():
    city = generated_city(3)
    upright = UprightScene.of(city, "z")
    cells = place_cells(upright, "triangles", OPTIONS)
    cells = cells.some(np.arange(0, len(cells), 4))
    found = find_pvs(upright, cells, OPTIONS)
    check = check_pvs(city, found.pvs, CheckOptions(cells=40, views=20))
    assert not check.leaks
    assert check.culled_share > 0.5


@pytest.mark.parametrize("puzzle", PUZZLES)
def test_what_is_seen_is_in_the_set(puzzle):
    puzzle = puzzle()
    found = named(found_in(puzzle.scene, puzzle.cells).pvs)
    assert puzzle.seen <= found


def test_what_one_box_hides_is_not_in_the_set():
    boxes = np.array([[[20.0, -9, 0], [22, 9, 9]], [[40, -3, 0], [42, 3, 3]]])
    scene = scene_of_boxes(boxes, ["wall", "house"])
    cell = ViewCells.boxes(np.array([[-2.0, -2, 0]]), np.array([[2.0, 2, 2]]))
    assert named(found_in(scene, cell).pvs) == {"wall"}
    tall = ViewCells.boxes(np.array([[-2.0, -2, 0]]), np.array([[2.0, 2, 30]]))
    assert named(found_in(scene, tall).pvs) == {"wall", "house"}
    below = ViewCells.boxes(np.array([[-2.0, -2, -3]]), np.array([[2.0, 2, 2]]))
    assert named(found_in(scene, below).pvs) == {"wall", "house"}  # one looks under the wall


def test_map_coordinates_change_nothing():
    city, shift = generated_city(3), np.array([4e6, 5e6, 300.0])
    cells = street_cells(city, 6, 5.0)
    there = city.transforms.copy()
    there[:, :3, 3] += shift
    far = Scene(city.meshes, city.names, np.array(city.mesh_of), there)
    upright = UprightScene.of(city, "z")
    near = ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)
    first = find_pvs(upright, near, OPTIONS).pvs
    second = find_pvs(UprightScene.of(far, "z"), near, OPTIONS).pvs
    for cell in range(len(cells)):
        assert np.array_equal(first.visible(cell), second.visible(cell))


def test_another_cell_changes_no_set():
    city = generated_city(4)
    upright = UprightScene.of(city, "z")
    cells = street_cells(city, 60, 2.5)
    cells = ViewCells.boxes(cells.low - upright.origin, cells.high - upright.origin)
    part = find_pvs(upright, cells.some(np.arange(20)), OPTIONS)
    both = find_pvs(upright, cells, OPTIONS, part.pvs)
    assert both.made == 40
    fresh = find_pvs(upright, cells, OPTIONS).pvs
    for cell in range(60):
        assert np.array_equal(fresh.visible(cell), both.pvs.visible(cell))
    other = PvsOptions(up="z", method="cull-map", cell_size=5.0)
    assert find_pvs(upright, cells, other, part.pvs).made == 60


def test_glass_hides_nothing():
    boxes = np.array([[[20.0, -9, 0], [22, 9, 9]], [[40, -3, 0], [42, 3, 3]]])
    scene = scene_of_boxes(boxes, ["glass", "house"])
    opaque = scene_of_boxes(boxes[1:], ["house"])
    cell = ViewCells.boxes(np.array([[-22.0, 7, 0]]), np.array([[-18.0, 11, 2]]))
    found = find_pvs(UprightScene.of(scene, "z"), cell, OPTIONS, opaque=opaque)
    assert named(found.pvs) == {"glass", "house"}
    assert named(find_pvs(UprightScene.of(scene, "z"), cell, OPTIONS).pvs) == {"glass"}


def test_buried_cells_are_refused_or_left_out():
    boxes = np.array([[[20.0, -9, 0], [32, 9, 9]], [[40, -3, 0], [42, 3, 3]]])
    scene = scene_of_boxes(boxes, ["wall", "house"])
    cells = ViewCells.boxes(
        np.array([[-2.0, -2, 0], [24, 0, 0]]), np.array([[2.0, 2, 2], [26, 2, 2]])
    )
    with pytest.raises(OptionError, match="cell 1 lies wholly within"):
        found_in(scene, cells)
    skipping = PvsOptions(up="z", method="strong", skip_buried=True)
    assert len(found_in(scene, cells, skipping).pvs.cells) == 1


@pytest.mark.parametrize("base", [0.0, 1.0])
def test_cells_in_what_is_not_convex_are_buried(base):
    """The boxes in a hall around a corner hid its lamp from a cell that is in two of them."""
    low = np.array([[0.6, 3.0, base + 0.1], [2.6, 3.0, base + 0.1], [3.5, 3.5, base + 0.1]])
    cells = ViewCells.boxes(low, low + np.array([1.0, 0.9, 1.6]))
    with pytest.raises(OptionError, match="cell 0 lies wholly within"):
        found_in(bent_hall(base), cells)
    skipping = PvsOptions(up="z", method="strong", skip_buried=True)
    (left,) = found_in(bent_hall(base), cells, skipping).pvs.cells.low[:, 0]
    assert left == pytest.approx(3.5)


def test_large_cells_are_told_of():
    boxes = np.array([[[20.0, -9, 0], [22, 9, 9]], [[40, -3, 0], [42, 3, 3]]])
    cell = ViewCells.boxes(np.array([[-2.0, -2, 0]]), np.array([[2.0, 2, 2]]))
    found = found_in(scene_of_boxes(boxes, ["wall", "house"]), cell)
    assert "narrower than 2" in found.warnings[0]
