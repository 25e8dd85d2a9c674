"""What a look at a scene tells of it."""

from __future__ import annotations

import numpy as np
import pytest

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.method import Task
from simplifier.visibility.scene_look import has_storeys, look_at, spread, standing_share


def task_of(scene, **options):
    upright = UprightScene.of(scene, "z")
    cells = ViewCells.boxes(np.zeros((1, 3)), np.array([[4.0, 6.0, 2.0]]))
    return Task(upright, cells, PvsOptions(up="z", **options), None, None, print)


def standing(scene, **options):
    return standing_share(task_of(scene, **options))


def scene_of(corners):
    return scene_of_boxes(np.array(corners, float), [f"{i}" for i in range(len(corners))])


def test_what_stands_is_solid_and_what_floats_is_not():
    ground, above = [(0, 0, 0), (10, 20, 10)], [(30, 0, 5), (40, 20, 15)]
    assert standing(scene_of([ground])) == 1.0
    assert standing(scene_of([ground, above])) == pytest.approx(0.5)
    assert standing(scene_of([ground, above]), ground=True) == 1.0
    slab = [(0, 0, 0), (100, 100, 5)]
    assert standing(scene_of([slab, above])) == 1.0
    assert look_at(task_of(scene_of([ground, above]))).width == 10.0
    assert look_at(task_of(scene_of([ground]))).size == 6.0


def test_sheets_are_neither_solid_nor_convex():
    square = TriangleMesh.from_soup(
        np.array([[0.0, 0, 0], [9, 0, 0], [9, 0, 9], [0, 0, 9]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    sheet = Scene((square,), ("sheet",), np.zeros(1, np.int32), np.eye(4)[None])
    found = look_at(task_of(sheet))
    assert (standing(sheet), found.convex, found.width) == (0.0, 0.0, 0.0)


def test_cells_above_others_are_storeys():
    low = np.array([[0.0, 0, 0], [5, 0, 0], [10, 0, 3]])
    assert not has_storeys(ViewCells.boxes(low, low + np.array([4.0, 4.0, 2.0])))
    low = np.concatenate([low, [[10.0, 0, 0]]])
    assert has_storeys(ViewCells.boxes(low, low + np.array([4.0, 4.0, 2.0])))


def test_places_are_spread_over_the_plan():
    x, y = np.meshgrid(np.arange(16.0), np.arange(16.0), indexing="ij")
    low = np.column_stack([x.ravel(), y.ravel(), np.zeros(256)])
    cells = ViewCells.boxes(low, low + 1.0)
    some = spread(cells, np.arange(256), 4)
    quarters = {(value // 8, other // 8) for value, other in low[some, :2].tolist()}
    assert len(quarters) == 4
    assert spread(cells, np.arange(3), 4).tolist() == [0, 1, 2]
