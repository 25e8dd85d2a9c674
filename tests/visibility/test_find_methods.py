"""What holds for every method: sets follow the scene, and what hides less hides nothing more."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from bench.visibility_city import generated_city, scene_of_boxes, street_cells
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.io.pvs_file import encode_pvs
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.find import find_pvs
from simplifier.visibility.placing.terrain_cells import place_on_terrain
from tests.visibility.rooms import two_rooms
from tests.visibility.solid.test_terrain import terrain_of


@dataclass(frozen=True)
class Case:
    """Boxes (n, 2, 3) and view cells (c, 2, 3), low and high corners in the world, z up."""

    boxes: np.ndarray
    cells: np.ndarray
    options: PvsOptions

    def changed(self, change, scale=1.0):
        """Both after a change of points that keeps boxes upright, by sorted corners."""
        boxes, cells = (np.sort(change(each), axis=1) for each in (self.boxes, self.cells))
        options = replace(self.options, epsilon=scale * self.options.epsilon)
        return Case(boxes, cells, options)

    def found(self, kept=None):
        chosen = np.arange(len(self.boxes)) if kept is None else kept
        names = [f"{index}" for index in chosen.tolist()]
        upright = UprightScene.of(scene_of_boxes(self.boxes[chosen], names), "z")
        cells = ViewCells.boxes(*(self.cells - upright.origin).transpose(1, 0, 2))
        return upright.scene, find_pvs(upright, cells, self.options).pvs

    def sets(self, kept=None):
        """(c, n) bool by the objects' numbers; those that are left out count as hidden."""
        scene, pvs = self.found(kept)
        result = np.zeros((len(self.cells), len(self.boxes)), bool)
        numbers = [int(name) for name in scene.names]
        result[:, numbers] = [pvs.visible(cell) for cell in range(len(self.cells))]
        return result


def street(method):
    city = generated_city(3, seed=2)
    cells = street_cells(city, 4, seed=5)
    # Whole numbers of 1/1024 stay what they are when they are moved and turned.
    exact = [np.round(1024.0 * each) / 1024.0 for each in (cells.low, cells.high, city.bounds())]
    options = PvsOptions(up="z", method=method, epsilon=5.0)
    return Case(exact[2], np.stack(exact[:2], axis=1), options)


def rooms(method):
    boxes = np.array(list(two_rooms().values()), dtype=np.float64)
    boxes = np.round(1024.0 * boxes) / 1024.0
    cells = np.array([[[1.0, 1.0, 0.25], [2.0, 2.0, 1.75]], [[5.0, 2.5, 0.25], [6.0, 3.5, 1.75]]])
    return Case(boxes, cells, PvsOptions(up="z", method=method, epsilon=0.5))


CASES = {"cull-map": street, "strong": street, "slice-wise": rooms}


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param](request.param)


def turned(points):
    return np.stack([-points[..., 1], points[..., 0], points[..., 2]], axis=-1)


def test_sets_grow_when_occluders_go(case):
    whole = case.sets()
    kept = np.flatnonzero(np.arange(len(case.boxes)) % 4 != 1)
    fewer = case.sets(kept)
    assert not (whole[:, kept] & ~fewer[:, kept]).any()
    assert fewer[:, kept].sum() > whole[:, kept].sum()


def test_order_place_and_size_of_the_scene_say_nothing(case):
    whole = case.sets()
    assert 0.0 < whole.mean() < 1.0
    mixed = np.random.default_rng(0).permutation(len(case.boxes))
    assert np.array_equal(case.sets(mixed), whole)
    way = np.array([512.0, -256.0, 64.0])
    assert np.array_equal(case.changed(lambda points: points + way).sets(), whole)
    assert np.array_equal(case.changed(lambda points: 4.0 * points, scale=4.0).sets(), whole)


def test_a_scene_that_is_turned_by_a_right_angle_has_no_leak_and_much_the_same_sets(case):
    there = case.changed(turned)
    # Rasters begin at the low corner, and cells are divided along x first: strong occluders that
    # are tried in another order find a few pairs more, or fewer.
    assert (there.sets() != case.sets()).mean() < 0.06
    scene, pvs = there.found()
    options = CheckOptions(cells=len(case.cells), views=12, pictures=1, pixels=64)
    assert not check_pvs(scene, pvs, options).leaks


def test_the_same_bytes_on_any_number_of_threads(case, monkeypatch):
    written = []
    for threads in ("1", "3"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        written.append(encode_pvs(case.found()[1]))
    assert written[0] == written[1]


def mountains(heights, spacing):
    terrain = terrain_of(heights, spacing, 4)
    upright = UprightScene.of(terrain.scene, "z")
    size = 4.0 * spacing[0]
    options = PvsOptions(up="z", method="voxel-column", cell_size=size, eye_height=spacing[0])
    cells = place_on_terrain(terrain, upright, "grid", options)
    return find_pvs(upright, cells, options, terrain=terrain).pvs


def ridges():
    x, y = np.meshgrid(np.arange(25.0), np.arange(25.0))
    heights = 24.0 * np.sin(0.5 * x + 0.2 * y) + np.random.default_rng(1).uniform(0.0, 4.0, x.shape)
    return np.round(64.0 * heights) / 64.0


def columns_of(pvs):
    return np.array([pvs.visible(cell) for cell in range(len(pvs.cells))])


def test_columns_follow_their_terrain_and_grow_when_ridges_go(monkeypatch):
    heights = ridges()
    whole = mountains(heights, (8.0, 8.0))
    sets = columns_of(whole)
    assert 0.1 < sets.mean() < 0.97
    assert np.array_equal(columns_of(mountains(heights + 512.0, (8.0, 8.0))), sets)
    assert np.array_equal(columns_of(mountains(4.0 * heights, (32.0, 32.0))), sets)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    assert encode_pvs(mountains(heights, (8.0, 8.0))) == encode_pvs(whole)
    # Nothing hides over a plain: all that was seen over ridges is seen there.
    assert columns_of(mountains(np.zeros_like(heights), (8.0, 8.0))).all()
