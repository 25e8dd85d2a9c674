"""Pictures of view cells: what they show is where it is, in its colour, and no word is cut off."""

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
from simplifier.visibility.pictures.pictures import (
    CELL,
    HIDDEN,
    OUT,
    SEEN,
    cells_picture,
    set_pictures,
    set_sizes,
)
from simplifier.visibility.pictures.plan import Plan, hillshade
from simplifier.visibility.pictures.plan_figure import PlanFigure, round_length

NAMES = {"largest.png", "median.png", "smallest.png", "umbra.png", "cells.png"}


@pytest.fixture(scope="module")
def found():
    """From left to right: a cell, a wall, and what it hides; above the cell a house in view."""
    boxes = np.array(
        [
            [(20.0, -60.0, 0.0), (30.0, 60.0, 30.0)],
            [(50.0, -10.0, 0.0), (70.0, 10.0, 10.0)],
            [(-10.0, 40.0, 0.0), (10.0, 55.0, 12.0)],
        ]
    )
    upright = UprightScene.of(scene_of_boxes(boxes, ["wall", "behind", "house"]), "z")
    corners = [[-5.0, -5.0, 0.0], [-5.0, 15.0, 0.0], [35.0, 75.0, 0.0]]
    low = np.array(corners) - upright.origin
    cells = ViewCells.boxes(low, low + np.array([10.0, 10.0, 2.0]))
    return upright, find_pvs(upright, cells, PvsOptions(epsilon=2.5))


@pytest.fixture(scope="module")
def drawn(found):
    upright, made = found
    return {
        name: cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        for name, data in set_pictures(upright, made.pvs, made.maps, "wall.glb").items()
    }


def places(image, colour):
    """(k, 2) columns and rows of pixels of a colour, without the legend below the plan."""
    wanted = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)])
    near = (np.abs(image.astype(int) - wanted) <= 3).all(axis=2)
    near = ndimage.minimum_filter(near, 5)  # no borders of letters
    rows, columns = np.nonzero(near[: int(0.88 * len(image))])
    return np.stack([columns, rows], axis=1)


def test_all_are_drawn(drawn):
    assert set(drawn) == NAMES
    for image in drawn.values():
        assert min(image.shape[:2]) > 500


def test_a_plan_shows_what_is_seen_and_what_is_hidden_where_it_is(found, drawn):
    _, made = found
    sizes = set_sizes(made.pvs)
    assert sizes.tolist() == [made.pvs.visible(cell).sum() for cell in range(3)]
    assert sizes.tolist() == [2, 2, 3]
    cell, seen, hidden = (places(drawn["smallest.png"], one) for one in (CELL, SEEN, HIDDEN))
    assert min(len(cell), len(seen), len(hidden)) > 500
    middle = cell.mean(axis=0)
    wall = seen[seen[:, 0] > middle[0] + 1.2 * np.ptp(cell[:, 0])]
    assert wall[:, 0].max() < hidden[:, 0].min()  # the hidden house is beyond the wall
    house = seen[seen[:, 0] < wall[:, 0].min() - 5]
    assert house[:, 1].max() < cell[:, 1].min()  # and the other above the cell


def test_what_reaches_out_of_the_umbra(drawn):
    image = drawn["umbra.png"]
    out = places(image, OUT)
    assert len(out) > 500
    dark = np.argwhere((image[..., 2] > 100) & (image[..., 0] < 60) & (image[..., 1] < 90))
    assert len(dark) > 5000  # a deep umbra behind the wall


def test_equal_sets_give_equal_pictures(found):
    assert cells_picture(found[1].pvs, "wall.pvs") == cells_picture(found[1].pvs, "wall.pvs")


def test_cells_without_a_scene(found):
    data = cells_picture(found[1].pvs, "wall.pvs")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    for end in ("#fde725", "#440154"):  # of the scale, the largest and the smallest set
        assert len(places(image, end)) > 500


@pytest.mark.parametrize("extent", [(100.0, 100.0), (30.0, 21.0), (700.0, 1000.0)])
def test_no_word_lies_outside_or_on_another(extent):
    low, high = np.zeros(2), np.array(extent)
    figure = PlanFigure(
        low, high, origin=np.array([1e6, -2e6, 0.0]), letters="zx",
        title="a_rather_long_name_of_a_scene_that_does_not_e...: what may be seen from cell 12345"
        " (smallest set)",
        lines="12,345 of 23,456 objects are in the set: 12,300 are certainly seen, 45 are open.\n"
        "11,111 are hidden (47.3 %), 11,000 of them beyond this picture.",
    )  # fmt: skip
    figure.legend([("#000000", "the cell"), ("#ffffff", "open: in the set, not proven")])
    figure.png()
    width, height = figure.figure.get_size_inches() * figure.figure.dpi
    axes = figure.axes
    words = [*figure.figure.texts, *figure.figure.legends]
    words += [*axes.get_xticklabels(), *axes.get_yticklabels()]
    boxes = [one.get_window_extent() for one in words]
    for index, box in enumerate(boxes):
        assert box.x0 >= 0.0 <= box.y0
        assert box.x1 <= width
        assert box.y1 <= height
        for other in boxes[:index]:
            assert not box.overlaps(other)


def test_a_plan_is_seen_from_above():
    boxes = np.array(
        [[(0.0, 0.0, 0.0), (10.0, 10.0, 5.0)], [(2.0, 2.0, 0.0), (4.0, 4.0, 9.0)],
         [(6.0, 6.0, 0.0), (8.0, 8.0, 3.0)]]
    )  # fmt: skip
    upright = UprightScene.of(scene_of_boxes(boxes, ["slab", "tower", "cellar"]), "z")
    kinds = np.array([1, 2, 3], dtype=np.uint8)
    plan = Plan.of(upright, kinds, np.array([-5.0, -5.0]), np.array([15.0, 15.0]), 40)
    shown = [plan.kinds[round((x + 5) / plan.cell), round((x + 5) / plan.cell)] for x in (-3, 3, 7)]
    assert shown == [0, 2, 1]
    assert plan.heights[round(8.0 / plan.cell), round(8.0 / plan.cell)] == 9.0
    assert plan.steps.any()
    assert not plan.steps[: round(4.0 / plan.cell)].any()
    colours = np.zeros((*plan.kinds.shape, 3), dtype=np.uint8)
    colours[:, -10:] = 255  # far along y is at the top
    picture = plan.picture(colours)
    assert picture.shape == (40, 40, 3)
    assert (picture[0] == 255).all()
    assert (picture[-1] == 0).all()


def test_hillshade_is_lit_from_the_upper_left():
    x, y = np.indices((9, 9)).astype(float)
    level, lit, dark = (hillshade(one, 1.0)[4, 4] for one in (0 * x, x - y, y - x))
    assert dark < level < lit


@pytest.mark.parametrize(("about", "length"), [(10.0, 10.0), (9.9, 5.0), (0.37, 0.2), (2100, 2000)])
def test_round_length(about, length):
    assert round_length(about) == pytest.approx(length)
