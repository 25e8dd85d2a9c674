"""The picture of strong occluders: who hides how many, and where."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy import ndimage

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.pictures.pictures import CELL, HIDDEN
from simplifier.visibility.pictures.strong_picture import LEFT, SHADES, hidden_by, strong_picture


@pytest.fixture(scope="module")
def found():
    """From left to right: a cell, a wall, and four houses behind it; one above the cell."""
    wall, above = [(20.0, -60.0, 0.0), (30.0, 60.0, 30.0)], [(-10.0, 40.0, 0.0), (10.0, 55.0, 12.0)]
    houses = [[(50.0, y, 0.0), (70.0, y + 15.0, 10.0)] for y in (-40.0, -20.0, 0.0, 20.0)]
    names = ["wall", "above", *(f"house {place}" for place in range(4))]
    upright = UprightScene.of(scene_of_boxes(np.array([wall, above, *houses]), names), "z")
    low = np.array([[-5.0, -5.0, 0.0]]) - upright.origin
    cells = ViewCells.boxes(low, low + np.array([10.0, 10.0, 2.0]))
    return upright, find_pvs(upright, cells, PvsOptions(method="strong"))


def places(image, colour):
    """(k, 2) columns and rows of pixels of a colour, without the legend below the plan."""
    wanted = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)])
    near = (np.abs(image.astype(int) - wanted) <= 3).all(axis=2)
    rows, columns = np.nonzero(ndimage.minimum_filter(near, 5)[: int(0.88 * len(image))])
    return np.stack([columns, rows], axis=1)


def test_a_body_hides_what_it_is_named_for(found):
    upright, made = found
    hidden = made.occluders.hide(made.pvs.cells)
    assert hidden.hidden[0].tolist() == [False, False, True, True, True, True]
    assert hidden_by(made.occluders, hidden.by[0]).tolist() == [4, 0, 0, 0, 0, 0]
    assert len(upright.scene) == 6


def test_what_hides_stands_between_the_cell_and_what_is_hidden(found):
    upright, made = found
    data = strong_picture(upright, made.pvs, made.occluders, "wall.glb")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    cell, wall, hidden, left = (places(image, one) for one in (CELL, SHADES[1], HIDDEN, LEFT))
    assert min(len(cell), len(wall), len(hidden), len(left)) > 500
    assert cell[:, 0].max() < wall[:, 0].min() < wall[:, 0].max() < hidden[:, 0].min()
    assert left[:, 1].max() < cell[:, 1].min()
    assert len(places(image, SHADES[0])) == len(places(image, SHADES[3])) == 0
