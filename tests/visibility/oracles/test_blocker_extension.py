"""The oracle of blocker extension: never hides what is seen, and sees as little as slices do."""

from __future__ import annotations

import numpy as np
import pytest

from tests.visibility.oracles import blocker_extension
from tests.visibility.oracles.blocker_extension import (
    hidden_voxels,
    meets,
    opaque_nodes,
    opaque_voxels,
    visible_boxes,
)
from tests.visibility.oracles.scenes import SCENES, dotted, staggered
from tests.visibility.rooms import found_names, sampled_names


def clutter(seed, shape=(12, 10, 8)):
    """Some boxes of voxels, and a cell of 2 x 2 x 2 in a corner that they leave free."""
    random = np.random.default_rng(seed)
    opaque = np.zeros(shape, bool)
    for _ in range(7):
        low = random.integers(0, np.array(shape) - 2)
        size = random.integers(1, 6, 3)
        opaque[tuple(slice(a, a + b) for a, b in zip(low, size, strict=True))] = True
    opaque[:3, :3, :3] = False
    return opaque, (np.full(3, 0.25), np.full(3, 1.75))


def blocked(eyes, points, opaque):
    """(k,) bool: whether segments (k, 3) to (k, 3) are in an opaque voxel at one of many places."""
    shares = np.linspace(0.0, 1.0, 801)[1:-1]
    met = np.zeros(len(eyes), bool)
    for share in shares:
        at = np.floor(eyes + share * (points - eyes)).astype(int)
        inside = ((at >= 0) & (at < opaque.shape)).all(axis=1)
        met[inside] |= opaque[tuple(at[inside].T)]
    return met


def lines_to_hidden(opaque, hidden, cell, count, random):
    """Eyes anywhere on and in the cell, points anywhere in hidden voxels, that solid is between."""
    places = np.argwhere(hidden)
    points = places[random.integers(0, len(places), count)] + random.uniform(0.0, 1.0, (count, 3))
    corners = random.random((count, 3)) < 0.3
    eyes = random.uniform(*cell, (count, 3))
    ends = np.where(random.random((count, 3)) < 0.5, *cell)
    return np.where(corners, ends, eyes), points


@pytest.mark.parametrize("seed", range(3))
def test_no_line_from_the_cell_reaches_a_hidden_voxel(seed):
    opaque, cell = clutter(seed)
    hidden = hidden_voxels(opaque, cell)
    assert hidden.sum() > 10
    eyes, points = lines_to_hidden(opaque, hidden, cell, 1000, np.random.default_rng(seed))
    assert blocked(eyes, points, opaque).all()


def test_a_blocker_that_is_a_voxel_too_large_is_found(monkeypatch):
    grown = blocker_extension.extended

    def larger(*given):
        return [(low, high + np.array([0, 1, 0])) for low, high in grown(*given)]

    monkeypatch.setattr(blocker_extension, "extended", larger)
    reached = 0
    for seed in range(2):
        opaque, cell = clutter(seed)
        hidden = hidden_voxels(opaque, cell)
        eyes, points = lines_to_hidden(opaque, hidden, cell, 1000, np.random.default_rng(seed))
        reached += int((~blocked(eyes, points, opaque)).sum())
    assert reached > 0


def test_nodes_of_the_octree_are_the_opaque_voxels_once_and_the_nearest_first():
    opaque, cell = clutter(3)
    opaque[4:8, 4:8, 4:8] = True
    nodes = opaque_nodes(opaque, cell)
    counted = np.zeros(opaque.shape, int)
    for low, high in nodes:
        counted[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] += 1
    assert np.array_equal(counted, opaque.astype(int))
    assert any((high - low == 4).all() for low, high in nodes)
    apart = [max(np.max(low - cell[1]), 0.0) for low, _ in nodes]
    assert apart[0] == min(apart)


def test_segments_meet_the_inside_of_a_box_and_not_its_border():
    box = np.zeros(3), np.ones(3)
    eye = np.array([-1.0, 0.5, 0.5])
    points = np.array([[2.0, 0.5, 0.5], [-0.5, 0.5, 0.5], [2.0, 5.0, 0.5], [2.0, 0.5, 1.5]])
    assert meets(eye, points, box).tolist() == [True, False, False, True]
    along = np.array([-1.0, 0.0, 0.5])
    assert not meets(along, np.array([[2.0, 0.0, 0.5]]), box).any()


def test_two_walls_hide_together_what_neither_hides_alone():
    small = staggered()
    for gone, seen in (((), False), (("right",), True), (("left",), True)):
        boxes = {name: box for name, box in small.boxes.items() if name not in gone}
        found = names_of(boxes, small.cells[0], small.voxel)
        assert ("house" in found) == seen
        assert "tower" in found


def names_of(boxes, cell, voxel):
    seen = visible_boxes(np.array(list(boxes.values())), np.array(cell), voxel)
    return {name for name, visible in zip(boxes, seen, strict=True) if visible}


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("name", SCENES)
def test_its_sets_hold_what_is_seen_and_are_about_those_of_slices(name, place):
    small = dotted(SCENES[name](), 30)
    cell = small.cells[place]
    found = names_of(small.boxes, cell, small.voxel)
    slices = found_names(small.boxes, cell)
    seen = sampled_names(small.boxes, cell, 10_000, np.random.default_rng(place))
    assert seen <= found
    assert seen <= slices
    assert len(found) < 0.9 * len(small.boxes)
    assert abs(len(found) - len(slices)) <= 0.25 * len(small.boxes)


def test_voxels_are_opaque_that_lie_in_one_box_wholly():
    boxes = np.array([[[0.0, 0.0, 0.0], [1.5, 1.0, 1.0]], [[1.6, 0.0, 0.0], [3.0, 1.0, 1.0]]])
    assert opaque_voxels(boxes, np.zeros(3), 0.5, (6, 2, 2))[:, 0, 0].tolist() == [
        True, True, True, False, True, True,
    ]  # fmt: skip
