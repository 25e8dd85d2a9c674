"""The plot and the contact sheet: drawn for whatever was measured, and red for what is wrong."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from simplifier.culling.contact_sheet import COLOURS, contact_sheet, plan_picture
from simplifier.culling.fate import Fate
from simplifier.culling.flythrough import fly
from simplifier.culling.flythrough_plot import flythrough_plot
from simplifier.culling.item_buffer import ItemBuffer
from simplifier.culling.shot import RED, Shot, view_picture
from simplifier.culling.upward import up_axis
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.options.scene import CullOptions
from tests.culling.occluded import (
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    street,
    tree_of,
    wall_with_window,
)
from tests.solids import box
from tests.walkable import scene_of

PARTS, COST = (0x1D, 0x5F, 0xC4), (0x00, 0x79, 0x5C)  # of the plot's lines
LEGEND = 48  # rows at the bottom, where all colours are


def flown(wall=WALL, occluders=None, *cameras, options=SMALL):
    scene = street(wall)
    made = {"wall": exact(WALL)} if occluders is None else occluders
    return fly(scene, tree_of(scene, made), path_of(*cameras), options)


def decoded(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]


def has(picture, colour):
    return bool((picture == colour).all(axis=-1).any())


def count_areas(mask, least):
    """Connected areas of so many pixels at least, by the boxes around them."""
    _, _, boxes, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return int((boxes[1:, cv2.CC_STAT_AREA] >= least).sum())


def sheet(found):
    return decoded(contact_sheet(found, "a $scene\udcff"))[:-LEGEND]


def test_red_is_what_is_culled_wrongly():
    right, wrong = flown(), flown(wall_with_window())
    assert right.total.wrong_pixels == 0 < wrong.total.wrong_pixels
    assert not has(right.shots[0].view, RED)
    assert has(wrong.shots[0].view, RED)
    assert not has(sheet(right), RED)
    assert has(sheet(wrong), RED)


def test_the_red_pixels_are_the_wrong_ones():
    found = flown(wall_with_window())
    red = (found.shots[0].view == RED).all(axis=-1)
    assert red.sum() == found.total.wrong_pixels  # so small a picture is not smoothed


def test_colours_tell_culled_from_missed():
    culled, missed = sheet(flown()), sheet(flown(occluders={}))
    assert has(culled, COLOURS[Fate.CULLED])
    assert not has(culled, COLOURS[Fate.MISSED])
    assert has(missed, COLOURS[Fate.MISSED])
    assert not has(missed, COLOURS[Fate.CULLED])


def test_one_wrong_pixel_of_a_large_view_is_seen():
    """It is smoothed four to one, which must not wash it out."""
    found = flown(wall_with_window(), options=CullOptions((320, 180), repeats=1))
    view = found.shots[0].view
    assert view.shape == (360, 640, 3)
    red = np.count_nonzero((view == RED).all(axis=-1))
    assert found.total.wrong_pixels / 4 <= red <= found.total.wrong_pixels


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_each_frame_has_its_place_in_the_plot_and_its_pictures_in_the_sheet(frames):
    found = flown(WALL, None, *[looking((x, -10.0, 3.0)) for x in range(frames)])
    picture = decoded(flythrough_plot(found, "a $scene\udcff"))
    # Frames stand in the middles of equal parts of the axis, which has room for two at least.
    left, width = 0.085 * picture.shape[1], 0.89 * picture.shape[1]
    parts = max(frames, 2)
    for colour, panel in ((PARTS, slice(190, 435)), (COST, slice(930, 1166))):
        rows, columns = np.nonzero((picture[panel] == colour).all(axis=-1))
        assert abs(columns.min() - (left + 0.5 / parts * width)) < 6
        assert abs(columns.max() - (left + (frames - 0.5) / parts * width)) < 6
        assert len(np.unique(rows)) > 3
    # As many pictures of depth as shots: the wall in it is the brightest.
    whites = (sheet(found) == found.shots[0].occluders.max()).all(axis=-1)
    assert len(found.shots) == frames
    assert count_areas(whites, least=200) == frames


def test_nothing_in_view_and_no_shots():
    for found in (
        flown(WALL, {}, looking(forward=(0.0, 0.1, 1.0))),
        replace(flown(), shots=()),
        flown(options=CullOptions((45, 80), repeats=1)),  # upright
    ):
        assert sheet(found).min() < 255
        assert decoded(flythrough_plot(found, "")).min() < 255


def plan(boxes, found, camera=None, up=2):
    """One picture of 100 x 100 of boxes with their fates."""
    nothing = np.zeros((1, 1), dtype=np.uint8)
    shot = Shot(0, camera or looking(), nothing, nothing, np.array(found, dtype=np.uint8))
    return plan_picture(shot, np.array(boxes, dtype=np.float64), up, (100, 100), 16 / 9)


def middle(picture, fate):
    """(x, y) of a colour."""
    y, x = np.nonzero((picture == COLOURS[fate]).all(axis=-1))
    return x.mean(), y.mean()


BOXES = [[[-9, 8, 0], [-6, 11, 3]], [[6, 8, 0], [9, 11, 3]], [[-2, 0, 0], [2, 2, 3]]]
FATES = [Fate.CULLED, Fate.MISSED, Fate.SEEN]


def test_a_plan_has_left_and_right_as_the_view():
    picture = plan(BOXES, FATES)
    left, right, near = (middle(picture, fate) for fate in FATES)
    assert left[0] < near[0] < right[0]
    assert left[1] == pytest.approx(right[1], abs=1.0)
    assert left[1] < near[1]  # further away is further up


@pytest.mark.parametrize("turn", [0.7, 2.0, 4.5])
def test_a_plan_turns_with_the_camera(turn):
    """The camera and the scene turned alike about the up axis give the same picture."""
    c, s = np.cos(turn), np.sin(turn)
    camera = looking((0.0, 0.0, 3.0), (-s, c, 0.0))
    # Boxes stay upright when turned, so take small ones.
    centres = np.array([[-8.0, 20.0, 0.0], [8.0, 20.0, 0.0]]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]]
    boxes = centres[:, None] + np.array([[-1.0], [1.0]])
    picture = plan(boxes, FATES[:2], camera)
    (left, far), (right, also) = (middle(picture, fate) for fate in FATES[:2])
    assert left < 50.0 < right
    assert far == pytest.approx(also, abs=1.5)


def test_what_is_wrong_lies_on_top():
    boxes = [[[-1, 5, 0], [1, 7, 1]], [[-9, 0, 0], [9, 12, 3]], [[-0.1, 5.9, 0], [0.1, 6.1, 1]]]
    assert has(plan(boxes, [Fate.WRONG, Fate.SEEN, Fate.CULLED]), COLOURS[Fate.WRONG])
    assert not has(plan(boxes, [Fate.SEEN, Fate.SEEN, Fate.CULLED]), COLOURS[Fate.WRONG])


def test_a_camera_that_looks_straight_down_has_a_plan():
    down = Camera(
        np.array([0.0, 5.0, 30.0]), np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, -1]]), 60.0, 0.1
    )
    picture = plan(BOXES, FATES, down)
    assert middle(picture, Fate.CULLED)[0] < middle(picture, Fate.MISSED)[0]


@pytest.mark.parametrize("up", [0, 1, 2])
@pytest.mark.parametrize("pitch", [-1.4, -0.6, 0.0, 0.3])
def test_the_up_axis_of_a_path(up, pitch):
    skyward = np.eye(3)[up]
    one, two = np.eye(3)[(up + 1) % 3], np.eye(3)[(up + 2) % 3]
    for turns in (np.linspace(0.0, 5.0, 7), [0.2]):
        ahead = [np.cos(pitch) * (np.cos(a) * one + np.sin(a) * two) + np.sin(pitch) * skyward
                 for a in turns]  # fmt: skip
        path = CameraPath(
            "", tuple(Camera.looking(np.zeros(3), a, skyward, 60.0, 0.1) for a in ahead)
        )
        assert up_axis(path) == up


def test_level_ground_has_one_shade():
    """Nothing in its normal points forward but rounding, which once striped it."""
    ground = scene_of(box((100.0, 100.0, 1.0), (-50.0, -50.0, -1.0)))
    camera = looking((0.0, 0.0, 1.7), (0.3, 1.0, 0.0))
    items = ItemBuffer(90, 160)
    items.draw(ground, camera)
    view = view_picture(items, camera, np.zeros(1, dtype=np.int32), np.array([Fate.SEEN]))
    near = view[60:]
    assert (np.ptp(near.astype(int), axis=(0, 1)) <= 12).all()  # distance darkens a little
