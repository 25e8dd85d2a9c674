"""Shafts that slices close, beside sampled lines of sight, and with faults put into them."""

from __future__ import annotations

import inspect
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.view_cells import ViewCells
from simplifier.kernels import shafts as kernels
from simplifier.visibility.slices import shafts as steps
from simplifier.visibility.slices.shafts import see_by_shafts
from tests.visibility.rooms import (
    CELL,
    cell,
    found_names,
    sampled_names,
    scene_of,
    seen_names,
    shafts_of,
    slits,
    two_rooms,
)
from tests.visibility.sheets import scene_of as scene_of_sheets

IN_WEST = ((0.5, 0.5, 0.2), (1.5, 1.5, 1.7))


def test_nobody_sees_out_of_a_closed_room():
    seen = seen_names(two_rooms(door=0.0), IN_WEST)
    assert seen == {"floor", "ceiling", "west", "south", "north", "wall a", "wall b"}


def test_through_a_door_some_of_the_next_room_is_seen():
    seen = seen_names(two_rooms(), IN_WEST, 0.1)
    assert "lamp" in seen
    assert not {"chest", "tree"} & seen


@pytest.mark.parametrize("width", [0.05, 0.25, 0.6])
def test_what_is_behind_a_narrow_door_is_in_the_set(width):
    """A door of a voxel, and narrower."""
    place = ((1.0, 1.8, 0.5), (1.5, 2.2, 1.6))
    assert "lamp" in seen_names(two_rooms(width), place)


def test_a_pane_thinner_than_a_voxel_hides():
    boxes = two_rooms() | {"pane": ((4.2, 1.5, 0.0), (4.21, 2.5, 3.0))}
    assert "lamp" not in seen_names(boxes, IN_WEST, 0.2)
    boxes["pane"] = ((4.2, 1.5, 0.0), (4.21, 2.49, 3.0))
    assert "lamp" in seen_names(boxes, ((1.0, 2.0, 0.5), (1.5, 2.6, 1.6)), 0.2)


@pytest.mark.parametrize("above", [False, True])
@pytest.mark.parametrize("voxels", [-2e-5, -1e-5, -4e-6, 4e-6, 1e-5, 2e-5])
def test_a_tile_is_not_hidden_by_the_slice_that_stands_for_it(voxels, above, monkeypatch):
    """In the ceiling of a dungeon lay tiles a micrometre lower than others.  The slice of both was
    at the lower ones, before the others, and hid them."""
    monkeypatch.setattr(steps, "_TRIES", 0)  # by which so large a tile is always found
    height = 2.0 + voxels * CELL

    def tile(x, y, z):
        corners = [[x, y, z], [x + 4.0, y, z], [x + 4.0, y + 4.0, z], [x, y + 4.0, z]]
        return TriangleMesh.from_soup(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))

    places = [(x, y) for x in (0.0, 4.0, 8.0) for y in (0.0, 4.0, 8.0)]
    tiles = {f"at {x} {y}": tile(x, y, height if x == y == 4.0 else 2.0) for x, y in places}
    scene = scene_of_sheets({**tiles, "below": tile(20.0, 0.0, 0.0)})
    upright, shafts = shafts_of(scene)
    low = np.array([5.0, 5.0, 3.0 if above else 0.5]) - upright.origin
    seen, _ = see_by_shafts(shafts, cell(low, low + np.array([1.0, 1.0, 0.5])))
    assert seen[0, list(scene.names).index("at 4.0 4.0")]


def test_what_is_in_the_cell_is_seen():
    boxes = two_rooms() | {"ball": ((1.0, 1.0, 0.5), (1.1, 1.1, 0.6))}
    assert "ball" in seen_names(boxes, IN_WEST)


def test_sets_are_the_same_by_the_way_that_users_take():
    assert found_names(two_rooms(), IN_WEST) == seen_names(two_rooms(), IN_WEST)


def test_another_seed_tries_other_lines_and_finds_the_same():
    place, boxes = PLACES[1]
    upright, shafts = shafts_of(scene_of(boxes))
    room = cell(*(np.array(corner) - upright.origin for corner in place))
    found = [see_by_shafts(shafts, room, seed=seed) for seed in (0, 1, 2, 3, 0)]
    assert len({seen.tobytes() for seen, _ in found}) == 1
    works = [int(work[0]) for _, work in found]  # what no line has shown is left to shafts
    assert works[0] == works[-1]
    assert len(set(works)) > 1


@st.composite
def clutter(draw):
    """Two rooms with some boxes in them, of which none or more are taken away, and a cell."""
    boxes = two_rooms(draw(st.sampled_from([0.0, 0.3, 1.0])))
    unit = st.integers(0, 20)
    for number in range(draw(st.integers(0, 6))):
        low = np.array([draw(unit) * 0.4, draw(unit) * 0.18, draw(unit) * 0.12])
        size = [0.1 + 0.1 * draw(unit) for _ in range(3)]
        boxes[f"box {number}"] = (tuple(low), tuple(low + size))
    low = np.array([0.2 + 0.15 * draw(unit), 0.2 + 0.12 * draw(unit), 0.1])
    return boxes, (tuple(low), tuple(low + np.array([0.8, 0.6, 1.5])))


@settings(max_examples=25, deadline=None)
@given(clutter(), st.integers(0, 2**32 - 1))
def test_what_is_sampled_is_in_the_set(made, seed):
    boxes, place = made
    found = sampled_names(boxes, place, 8_000, np.random.default_rng(seed))
    assert found <= seen_names(boxes, place)


@settings(max_examples=15, deadline=None)
@given(clutter(), st.integers(0, 2**32 - 1))
def test_where_less_is_covered_nothing_more_is_hidden(made, seed):
    boxes, place = made
    upright, shafts = shafts_of(scene_of(boxes))
    random = np.random.default_rng(seed)
    low, high = (np.array(corner) - upright.origin for corner in place)
    masks = [mask & (random.random(mask.shape) < 0.99) for mask in shafts.slices.covered]
    fewer = steps.Shafts.of(replace(shafts.slices, covered=tuple(masks)), shafts.targets)
    with patch.object(steps, "_LIMIT", 10**7), patch.object(steps, "_TRIES", 0):
        before, _ = steps.see_by_shafts(shafts, cell(low, high))
        after, _ = steps.see_by_shafts(fewer, cell(low, high))
    assert not (before & ~after).any()


def plain_shaft(low_a, high_a, low_b, high_b, slices, random, count):
    """Whether one of some lines between two boxes passes no covered pixel; by sampling."""
    a = random.uniform(low_a, high_a, (count, 3))
    b = random.uniform(low_b, high_b, (count, 3))
    free = np.ones(count, dtype=bool)
    for k in range(3):
        v, w = (k + 1) % 3, (k + 2) % 3
        for at, picture in zip(slices.ats[k], slices.covered[k], strict=True):
            with np.errstate(divide="ignore", invalid="ignore"):
                share = (at - a[:, k]) / (b[:, k] - a[:, k])
            crosses = (share > 0.0) & (share < 1.0)
            points = a + np.where(crosses, share, 0.0)[:, None] * (b - a)
            place = [
                np.searchsorted(slices.edges[axis], points[:, axis], "right") - 1 for axis in (v, w)
            ]
            inside = crosses & (place[0] >= 0) & (place[1] >= 0)
            inside &= (place[0] < picture.shape[0]) & (place[1] < picture.shape[1])
            free[inside] &= ~picture[place[0][inside], place[1][inside]]
    return bool(free.any())


def test_no_line_gets_through_a_shaft_that_is_called_closed():
    _, shafts = shafts_of(scene_of(two_rooms(0.5)))
    random = np.random.default_rng(3)
    top = shafts.slices.grid.shape.astype(float)
    results = []
    for _ in range(120):
        a, b = random.uniform(0.0, top, (2, 3))
        sizes = random.uniform(0.0, 4.0, (2, 3))
        one, other = np.concatenate([a, a + sizes[0]]), np.concatenate([b, b + sizes[1]])
        found = kernels.shaft(
            one, other, True, shafts.free, shafts.slices.ats, shafts.firsts, shafts.slices.edges,
            shafts.sums, np.zeros(2, np.int64), np.zeros(1),
        )  # fmt: skip
        results.append(found)
        free = plain_shaft(one[:3], one[3:], other[:3], other[3:], shafts.slices, random, 200)
        assert not (found == kernels.CLOSED and free)
    assert {kernels.CLOSED, kernels.CROSSED} <= set(results)


FAULTS = {
    "a span one pixel short": (
        "return _pixel(edges, low - _ROUND), _pixel(edges, high + _ROUND)",
        "return _pixel(edges, low - _ROUND) + 1, _pixel(edges, high + _ROUND) - 1",
    ),
    "a face of the cell left out": ("for side in range(6):", "for side in range(3):"),
    "one child of each box alone": (
        "for child in range(first, last):", "for child in range(first, first + 1):",
    ),
    "half of a face": ("            count += 2\n", "            count += 1\n"),
}  # fmt: skip


PLAIN = (
    "inline_kernel = inner_kernel = lambda function: function; kernel = lambda takes: inner_kernel"
)


def faulty(fault):
    """The kernel's source with a fault, as plain Python."""
    old, new = FAULTS[fault]
    source = inspect.getsource(kernels)
    assert source.count(old) == 1, fault
    source = source.replace(old, new).replace(
        "from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel", PLAIN
    )
    space = {}
    exec(compile(source, fault, "exec"), space)
    return space["see"]


PLACES = [(((1.0, 0.5, 0.2), (2.5, 3.5, 1.7)), slits(seed)) for seed in range(4)]


def leaks(see, viewpoints, monkeypatch):
    """What lines from so many viewpoints of cells before doors see, and sets do not have."""
    monkeypatch.setattr(steps, "see", see)
    monkeypatch.setattr(steps, "_TRIES", 0)
    random = np.random.default_rng(7)
    missing = set()
    with np.errstate(over="ignore"):
        for place, boxes in PLACES:
            found = sampled_names(boxes, place, viewpoints // len(PLACES) * 400, random)
            missing |= found - seen_names(boxes, place)
    return missing


@pytest.mark.slow
@pytest.mark.sweep(2)
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_found(fault, monkeypatch):
    """Within 1,000 viewpoints, 400 lines from each."""
    assert leaks(faulty(fault), 1000, monkeypatch)


@pytest.mark.slow
def test_without_faults_nothing_is_found(monkeypatch):
    assert not leaks(kernels.see, 1000, monkeypatch)


def test_prisms_count_as_the_boxes_around_them():
    scene = scene_of(two_rooms())
    upright, shafts = shafts_of(scene)
    low, high = (np.array(corner) - upright.origin for corner in IN_WEST)
    corners = np.array([[[low[0], low[1]], [high[0], low[1]], [high[0], high[1]]]])
    prism = ViewCells.prisms(corners, low[2:], high[2:])
    as_box, _ = steps.see_by_shafts(shafts, cell(low, high))
    assert (steps.see_by_shafts(shafts, prism)[0] == as_box).all()
