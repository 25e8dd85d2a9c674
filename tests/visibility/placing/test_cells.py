"""Where cells are placed: over what one can stand on, and no higher than eyes are there."""

from __future__ import annotations

import numpy as np
import pytest

import simplifier.visibility.placing.cells as cells
from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import Columns, UprightScene
from simplifier.errors import OptionError
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.placing.cells import place_cells

OPTIONS = PvsOptions(up="z", cell_size=10.0, eye_height=2.0)


def upright():
    """A box of 20 x 10 x 5."""
    return UprightScene.of(scene_of_boxes(np.array([[[0.0, 0, 0], [20, 10, 5]]]), ["box"]), "z")


@pytest.fixture
def stand(monkeypatch):
    """The ground, and where one can stand, by columns of two metres."""

    monkeypatch.setattr(cells, "AROUND", 0.0)

    def put(ground, free):
        columns = Columns(np.zeros(2), 2.0, ground, ground)
        monkeypatch.setattr(cells, "_ground", lambda upright, eye: (columns, ground, free.copy()))

    return put


def test_a_cell_reaches_no_higher_than_eyes_where_one_can_stand(stand):
    ground, free = np.zeros((10, 5)), np.ones((10, 5), bool)
    ground[1, 1], free[1, 1] = 30.0, False
    ground[2, 2], ground[7, 1] = 1.0, -3.0
    stand(ground, free)
    placed = place_cells(upright(), "walkable", OPTIONS)
    assert placed.low.tolist() == [[0.0, 0.0, 0.0], [10.0, 0.0, -3.0]]
    assert placed.high.tolist() == [[10.0, 10.0, 3.0], [20.0, 10.0, 2.0]]
    assert place_cells(upright(), "grid", OPTIONS).high[0, 2] == 32.0


def test_cells_hold_all_of_the_eyes_of_a_walk_around_the_scene():
    """Five eye heights away from all objects, as far as walks lead, and at the very top."""
    placed = place_cells(upright(), "walkable", PvsOptions(up="z", cell_size=10.0, eye_height=1.7))
    for x, y in ((-8.4, -8.4), (28.4, 18.4), (10.0, -4.0)):
        assert len(placed.containing(np.array([x, y, 1.7])))


def test_where_one_cannot_stand_is_no_cell(stand):
    free = np.zeros((10, 5), bool)
    stand(np.zeros((10, 5)), free)
    with pytest.raises(OptionError, match="no place to stand on"):
        place_cells(upright(), "walkable", OPTIONS)
    free[8, 2] = True
    stand(np.zeros((10, 5)), free)
    assert place_cells(upright(), "walkable", OPTIONS).low.tolist() == [[10.0, 0.0, 0.0]]
