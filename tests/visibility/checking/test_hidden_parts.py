"""Hidden slices that a viewpoint sees are found, and no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simplifier.geometry.pvs import Slices, drawn
from simplifier.options.visibility import PvsOptions
from simplifier.visibility.checking.check import CheckOptions, check_pvs
from simplifier.visibility.checking.hidden_parts import hidden_boxes, surface_points
from simplifier.visibility.find import find_pvs
from tests.visibility.checking.test_check import everything, pvs_of
from tests.visibility.scenes import puzzle
from tests.visibility.test_find import city_and_cells


def test_hidden_boxes_are_what_no_slice_draws():
    random = np.random.default_rng(0)
    x, y, z = np.meshgrid(np.arange(-7, 8), np.arange(-7, 8), [0, *range(2, 9)], indexing="ij")
    values = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.int8)
    boxes = np.tile(np.array([[1.0, -2.0, 3.0], [9.0, 14.0, 7.0]]), (len(values), 1, 1))
    hidden = hidden_boxes(boxes, values)
    ranges = drawn(values)
    for _ in range(20):
        slices = random.integers(1, 9, 3)  # the slice of a point along each axis
        point = boxes[0, 0] + (slices - 0.5) / 8 * (boxes[0, 1] - boxes[0, 0])
        within = ((hidden[:, 0] < point) & (point < hidden[:, 1])).all(axis=1)
        shown = ((ranges[:, :, 0] <= slices) & (slices <= ranges[:, :, 1])).any(axis=1)
        assert np.array_equal(within, ~shown)


def test_points_are_on_what_of_triangles_is_in_a_box():
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [0, 0, 4], [0, 9, 0], [1, 9, 0], [0, 9, 1]])
    faces = np.array([[0, 1, 2], [3, 4, 5]], dtype=np.int32)
    points = surface_points(vertices, faces, np.array([[0.0, -1, 1], [9, 1, 2]]), 1e-3)
    # Of the first triangle a trapezium is left, of the second nothing.
    assert len(points) == 2 * 5
    assert np.allclose(np.abs(points[:, 1]), 1e-3)
    assert points[:, [0, 2]].min(axis=0) == pytest.approx([0.0, 1.0], abs=0.01)
    assert points[:, 0].max() == pytest.approx(3.0, abs=0.01)
    assert points[:, 2].max() == pytest.approx(2.0, abs=0.01)
    assert (points[:, 0] + points[:, 2] < 4.0).all()


def hiding(values):
    """What is certainly seen of the slices that are hidden of a house in plain view."""
    scene = puzzle({"house": ((20.0, 36.0), (-8.0, 8.0), 16.0)})
    pvs = pvs_of(scene.scene, scene.cells, everything(scene.scene, scene.cells))
    slices = Slices(np.array([0, 1]), np.array([values], dtype=np.int8))
    check = check_pvs(scene.scene, replace(pvs, slices=slices), CheckOptions(views=12, azimuths=8))
    return [(leak.name, leak.proof) for leak in check.leaks]


def test_a_hidden_slice_in_plain_view_is_found():
    # The front is the first slice along x.
    for values in ([-1, 0, 0], [0, -3, 0], [0, 3, 0], [0, 0, 2], [-1, 2, 5], [-7, -7, 2]):
        assert hiding(values) == [("house", "slice")]
    for values in ([0, 0, 0], [1, 0, 0], [3, 0, 4], [1, 2, 0]):
        assert hiding(values) == []


def test_a_hair_above_a_roof_is_not_the_roof():
    # The eyes are a tenth of a millimetre below the roof, and the hair is two tenths.
    boxes = {"house": ((200.0, 230.0), (-20.0, 20.0), 2.0001), "far": ((2e3, 2001.0), (0, 1), 1.0)}
    scene = puzzle(boxes)
    pvs = pvs_of(scene.scene, scene.cells, everything(scene.scene, scene.cells))
    values = np.array([[1, 0, 0], [0, 0, 0]], dtype=np.int8)
    look = CheckOptions(views=12, azimuths=8)
    hidden = replace(pvs, slices=Slices(np.array([0, 2]), values))
    assert check_pvs(scene.scene, hidden, look).leaks == ()
    boxes["house"] = (*boxes["house"][:2], 1.9)
    low = puzzle(boxes).scene
    seen = check_pvs(low, hidden, look).leaks
    assert [(leak.name, leak.proof) for leak in seen] == [("house", "slice")]


def test_slices_of_a_city_hide_nothing_seen_and_hardly_less():
    upright, cells = city_and_cells(3, 8, seed=6)
    found = find_pvs(upright, cells, PvsOptions(up="z", slices=True)).pvs
    look = CheckOptions(cells=8, views=20, azimuths=90)
    assert not check_pvs(upright.scene, found, look).leaks
    # Were one more slice hidden, it would be seen.
    values = found.slices.values.copy()
    values[:, 2] += (values[:, 2] > 0) & (values[:, 2] < 8)
    for axis in (0, 1):
        column = values[:, axis]
        column -= ((column < 0) & (column > -7)) | (column > 1)
    wrong = replace(found, slices=replace(found.slices, values=values))
    leaks = check_pvs(upright.scene, wrong, look).leaks
    assert len(leaks) > 3
    assert {leak.proof for leak in leaks} == {"slice"}
