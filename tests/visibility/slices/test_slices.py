"""Slices: which pixels closed boxes and flat sheets cover, beside points of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.camera_paths.columns import UprightScene
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.scene import Scene
from simplifier.visibility.slices.slices import AXES, Grid, slices_of
from tests.visibility.rooms import cell, scene_of

STEPS = st.integers(0, 12)


def sliced(scene, size=0.25, lowest=0.0):
    upright = UprightScene.of(scene, "z")
    viewers = cell((-10.0, -10.0, lowest), (-9.0, -9.0, lowest + 1.7))
    return upright, slices_of(upright, Grid.around(upright, size), viewers)


def hides(slices, axis, at, low, high):
    """Whether pixels that hold a rectangle are covered in the slice nearest to ``at``."""
    place = int(np.argmin(np.abs(slices.ats[axis] - at)))
    spans = []
    for other, begin, end in zip(AXES[axis][1:], low, high, strict=True):
        edges = slices.edges[other]
        spans.append(
            slice(
                int(np.searchsorted(edges, begin, "right")) - 1,
                int(np.searchsorted(edges, end, "left")),
            )
        )
    return bool(slices.covered[axis][place][tuple(spans)].all())


@st.composite
def heaps(draw):
    boxes = {}
    for number in range(draw(st.integers(1, 6))):
        # No two share a corner, or they would be one piece.
        low = np.array([draw(STEPS), draw(STEPS), draw(STEPS)]) * 0.31 + 0.007 * number
        size = 0.1 + np.array([draw(STEPS), draw(STEPS), draw(STEPS)]) * 0.17 + 0.0013 * number
        boxes[str(number)] = (low, low + size)
    return boxes


@settings(max_examples=8, deadline=None)
@given(heaps(), st.integers(0, 2**32 - 1))
def test_what_is_covered_is_within_boxes(boxes, seed):
    """Points of covered pixels lie in a box; pixels with an own box around them are covered."""
    upright, slices = sliced(scene_of(boxes))
    corners = slices.grid.to_grid(np.array(list(boxes.values())) - upright.origin)
    random = np.random.default_rng(seed)
    for axes in AXES:
        ats, covered = slices.ats[axes[0]], slices.covered[axes[0]]
        edges = [slices.edges[axis] for axis in axes[1:]]
        i, v, w = np.nonzero(np.ones_like(covered))
        own = np.zeros(len(i), dtype=bool)
        points = np.column_stack(
            [ats[i]]
            + [
                edge[place] + random.random(len(i)) * np.diff(edge)[place]
                for edge, place in zip(edges, (v, w), strict=True)
            ]
        )
        inside = np.zeros(len(i), dtype=bool)
        for low, high in corners[:, :, list(axes)]:
            inside |= ((points >= low) & (points <= high)).all(axis=1)
            around = (ats[i] > low[0]) & (ats[i] < high[0])
            for edge, place, axis in zip(edges, (v, w), (1, 2), strict=True):
                around &= (edge[place] >= low[axis]) & (edge[place + 1] <= high[axis])
            own |= around
        assert not (covered.ravel() & ~inside).any()
        assert not (own & ~covered.ravel()).any()


@pytest.mark.parametrize(("gap", "closed"), [(0.0, True), (1e-3, False)])
def test_boxes_that_touch_leave_no_crack(gap, closed):
    """The crack is not along an edge of pixels, since the face there is too small for that."""
    boxes = {
        "a": ((0.0, 0.0, 0.0), (0.4, 1.13, 3.0)),
        "b": ((0.0, 1.13 + gap, 0.0), (0.4, 3.0, 3.0)),
    }
    _, slices = sliced(scene_of(boxes))
    shift = slices.grid.to_grid(np.zeros(3))
    low, high = shift[1:] + 2.0, shift[1:] + 8.0
    assert hides(slices, 0, shift[0] + 0.8, low, high) == closed


def scene_of_soup(corners, faces):
    return Scene.of(TriangleMesh.from_soup(np.array(corners, dtype=np.float64), np.array(faces)))


BOX_FACES = [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5], [2, 3, 7],
             [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip


def open_box():
    """Without its lower side: corners by x, y and z, the last first."""
    corners = [[x, y, z] for x in (0.0, 2.0) for y in (0.0, 2.0) for z in (0.0, 2.0)]
    faces = [face for face in BOX_FACES if not all(corners[corner][2] == 0.0 for corner in face)]
    return scene_of_soup(corners, faces)


@pytest.mark.parametrize(("lowest", "solid"), [(0.0, True), (-1.0, False)])
def test_what_stands_open_on_the_ground_is_closed_by_it(lowest, solid):
    """Unless one may look from below."""
    _, slices = sliced(open_box(), lowest=lowest)
    shift = slices.grid.to_grid(np.zeros(3))
    low, high = shift[1:] + 1.0, shift[1:] + 7.0
    assert hides(slices, 0, shift[0] + 4.0, low, high) == solid


def test_an_open_sheet_has_a_slice_of_its_own():
    corners = [[1.0, 0.0, 0.0], [1.0, 3.0, 0.0], [1.0, 3.0, 3.0], [1.0, 0.0, 3.0], [0, 0, 0],
               [2.0, 0, 0], [2.0, 0.1, 0.4]]  # fmt: skip
    _, slices = sliced(scene_of_soup(corners, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]))
    shift = slices.grid.to_grid(np.zeros(3))
    assert shift[0] + 4.0 in slices.ats[0]
    assert hides(slices, 0, shift[0] + 4.0, shift[1:] + 1.0, shift[1:] + 11.0)
    assert not hides(slices, 0, shift[0] + 4.6, shift[1:] + 1.0, shift[1:] + 11.0)
    assert 0.0 < slices.lost < 0.1


def test_edges_of_pixels_stay_in_order():
    rng = np.random.default_rng(0)
    lows = rng.uniform(0.0, 6.0, (30, 3))
    boxes = {str(k): (low, low + rng.uniform(0.5, 3.0, 3)) for k, low in enumerate(lows)}
    _, slices = sliced(scene_of(boxes))
    for edges, count in zip(slices.edges, slices.grid.shape, strict=True):
        assert len(edges) == count + 1
        assert (np.diff(edges) > 0.0).all()
        assert (np.abs(edges - np.arange(count + 1)) < 0.5).all()
