"""The picture of slices: of the object that tells most, what is hidden is left open."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from bench.visibility_city import scene_of_boxes
from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.view_cells import ViewCells
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.find import find_pvs
from simplifier.visibility.pictures.framed_figure import FramedFigure, rgb
from simplifier.visibility.pictures.pictures import CELL, SEEN
from simplifier.visibility.pictures.slanted_view import SlantedView
from simplifier.visibility.pictures.slices_picture import slices_picture
from simplifier.visibility.pictures.telling_slices import telling_slices

NAMES = ["wall", "tower", "shed"]
WIDE = 400  # pixels of the picture here


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr("simplifier.visibility.pictures.slices_picture.PIXELS", WIDE)


def found(turned=False):
    """A tower of which a cell draws the upper five slices, a wall before it, and a shed.

    ``turned``: y is up.
    """
    boxes = np.array(
        [
            [(20.0, -60.0, 0.0), (24.0, 60.0, 20.0)],
            [(40.0, -20.0, 0.0), (44.0, 20.0, 42.0)],
            [(-40.0, -10.0, 0.0), (-30.0, 10.0, 5.0)],
        ]
    )
    up = "y" if turned else "z"
    if turned:
        boxes = boxes[:, :, [1, 2, 0]]
    upright = UprightScene.of(scene_of_boxes(boxes, NAMES), up)
    low = np.array([[-5.0, -5.0, 0.0]]) - upright.origin
    cells = ViewCells.boxes(low, low + np.array([10.0, 10.0, 2.0]))
    pvs = find_pvs(upright, cells, PvsOptions(up=up, epsilon=1.0, slices=True)).pvs
    # Walls and the shed hide their own far sides, which nobody would miss.
    pvs.slices.values[:] = [[2, 0, 0], [0, 0, 4], [-4, 0, 0]]
    return upright, pvs


def of_hue(image, colour):
    """(rows, columns) the pixels that are of a colour in any light."""
    hues = cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2HSV_FULL).astype(int)
    wanted = cv2.cvtColor(rgb(colour).astype(np.uint8)[None, None], cv2.COLOR_RGB2HSV_FULL)
    off = np.abs(hues[..., 0] - int(wanted[0, 0, 0]))
    return (np.minimum(off, 256 - off) <= 4) & (hues[..., 1] > 150)


def test_the_tower_is_drawn_without_what_the_wall_hides_of_it():
    upright, pvs = found()
    best = telling_slices(upright, pvs)
    assert (best.cell, NAMES[best.object]) == (0, "tower")
    assert best.hidden[1, 2] == best.box[0, 2] + 3 * 42.0 / 8
    assert (best.hidden[0] < best.box[0]).all()  # its sides and its floor are hidden, too
    image = cv2.imdecode(
        np.frombuffer(slices_picture(upright, pvs, "town.glb"), np.uint8), cv2.IMREAD_COLOR
    )[..., ::-1]
    shown = image[150:-70, 30:-30]
    drawn = of_hue(shown, SEEN)
    assert of_hue(shown, CELL).sum() > 100
    # As much of the tower is painted as is in sight above the block, seams and all.
    view = SlantedView.past(np.array([pvs.cells.low[0], pvs.cells.high[0]]), best.box)
    corners = np.stack(np.meshgrid(*best.box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    top, floor = (corners[corners[:, 2] == z] for z in best.box[:, 2][::-1])
    cut = floor.copy()
    cut[:, 2] = best.hidden[1, 2]
    places = np.concatenate([view.on_picture(top), view.on_picture(cut)])
    hull = cv2.convexHull((WIDE * places).astype(np.float32))
    assert drawn.sum() == pytest.approx(cv2.contourArea(hull), rel=0.02)


def test_axes_have_the_names_of_the_world(monkeypatch):
    told = []

    class Heard(FramedFigure):
        def __init__(self, *size, **words):
            told.append(words)
            super().__init__(*size, **words)

    monkeypatch.setattr("simplifier.visibility.pictures.slices_picture.FramedFigure", Heard)
    assert slices_picture(*found(turned=True), "town.glb")
    title, lines = told[0]["title"], told[0]["lines"]
    assert title == "town.glb: the slices of 'tower'"
    assert lines.startswith("From cell 0, of its 8 slices along each axis, ")
    assert " to 8 along y are drawn: " in lines
    assert " along z " not in lines


def test_without_a_partly_drawn_object_there_is_no_picture():
    upright, pvs = found()
    pvs.slices.values[:] = 0
    assert slices_picture(upright, pvs, "town.glb") is None
