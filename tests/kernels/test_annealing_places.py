"""Where corners and triangles are put: by gains counted plainly, and on a part that is bare."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.geometry.room import Room
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.annealing import (
    _ASIDE,
    _LOOKS,
    _LOSS,
    TRIES,
    _draw_step,
    _gain_at,
    _gain_of,
    _place_anywhere,
    _transpose,
)
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.soup_views import UNIT, all_contained
from simplifier.refinement.annealing import Annealing, Prices, RefineViews
from tests.kernels.bits import blob, packed, unpacked
from tests.pictures import sphere_projections

SIZE = 24  # cells a side
VIEWS = 12
PROJECTIONS = sphere_projections(
    image_axes(hemisphere_directions(VIEWS)), np.full(3, SIZE / 2), SIZE / 2
)
PARTS = np.array([[6.0, 12.0, 12.0], [18.0, 12.0, 12.0]])  # centres of two balls
RADIUS = 4.5


def two_balls():
    """(24, 24, 24) bool."""
    centres = np.moveaxis(np.indices((SIZE,) * 3), 0, -1) + 0.5
    return np.any([((centres - part) ** 2).sum(axis=-1) < RADIUS**2 for part in PARTS], axis=0)


def gain_in(view, point, original, union):
    """Of a point in a view, from whole pictures."""
    column, row = np.floor(PROJECTIONS[view, :, :3] @ point + PROJECTIONS[view, :, 3]).astype(int)
    if not (0 <= column < 64 and 0 <= row < 64):
        return -_LOSS
    inside, covered = unpacked(original)[row, column], unpacked(union)[row, column]
    return 0 if covered else 1 if inside else -_LOSS


def lookup(projections, originals):
    """What gains are looked up in."""
    places = len(projections) + _LOOKS
    transposed, order = np.empty((8, places)), np.empty(places, np.int64)
    _transpose(projections, transposed, order)
    return transposed, order, originals


@pytest.mark.parametrize("seed", range(4))
def test_gains_are_those_of_pixels(seed):
    """Of points in and beside the grid; in views that follow each other, in a circle."""
    rng = np.random.default_rng(seed)
    originals = np.stack([packed(blob(seed + view, 0.6)) for view in range(VIEWS)])
    layers = np.zeros((VIEWS, 3, 64), np.uint64)
    layers[:, 0] = [packed(blob(99 + seed + view, 0.3)) for view in range(VIEWS)]
    seen = (lookup(PROJECTIONS, originals), layers)

    def plain(point, first):
        views = [(first + look) % VIEWS for look in range(_LOOKS)]
        return sum(gain_in(view, point, originals[view], layers[view, 0]) for view in views)

    found = set()
    for _ in range(30):
        first, triangle = int(rng.integers(VIEWS)), rng.uniform(-4.0, SIZE + 4.0, (3, 3))
        middle = triangle.mean(axis=0)
        points = [middle, *(middle + _ASIDE * (triangle - middle))]
        found.add(plain(middle, first))
        assert _gain_at(*middle, first, *seen) == plain(middle, first)
        assert _gain_of(triangle, first, *seen) == sum(plain(point, first) for point in points)
    assert min(found) < 0 < max(found)


def test_half_of_all_steps_lead_to_gaps():
    """A point at the edge of what is covered, with half of all steps to a gap and half beyond the
    outline; of few steps by lot that go the right way one is drawn, half of the time."""
    original, union = np.zeros((64, 64), bool), np.zeros((64, 64), bool)
    original[:, :40], union[:, :32] = True, True
    originals = np.repeat(packed(original)[None], VIEWS, axis=0)
    layers = np.zeros((VIEWS, 3, 64), np.uint64)
    layers[:, 0] = packed(union)
    projections = np.zeros((VIEWS, 2, 4))
    projections[:, 0, 0], projections[:, 1, 1] = 1.0, 1.0
    seen = (lookup(projections, originals), layers)
    state, delta = np.array([5], np.uint64), np.zeros(3)
    ends = []
    for _ in range(1000):
        _draw_step(np.array([32.0, 32.0, 32.0]), 60.0, *seen, state, delta)
        assert np.abs(delta).max() <= 30.0
        ends.append(32.0 + delta[0])
    share = np.mean([32.0 <= x < 40.0 for x in ends])
    by_lot = 8.0 / 60.0
    best_of_many = 1.0 - (1.0 - by_lot) ** 16
    assert share == pytest.approx(0.5 * by_lot + 0.5 * best_of_many, abs=0.05)


def test_corners_are_drawn_until_they_are_in_the_room():
    """Of a small room in a large grid, where a corner by lot would seldom be."""
    room = Room.of(two_balls())
    there, trial = np.tile(PARTS[0], (1, 3, 1)), np.zeros((3, 3))
    there[0] += [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    state, before = np.array([7], np.uint64), room.cells_before
    inside = 0
    for _ in range(400):
        _place_anywhere(there, room.voxels, before, 0.3 * SIZE, state, trial)
        kept = np.zeros(3, np.bool_)
        all_contained(np.repeat(trial[:, None], 3, axis=1), room.voxels, kept)
        inside += int(kept.all())
    assert inside > 300


def test_a_part_that_no_triangle_hides_gets_some():
    """All lie in one ball; the other is found from there, though no corner could move to it."""
    points = np.random.default_rng(3).normal(size=(3000, 3))
    points *= RADIUS / np.linalg.norm(points, axis=1, keepdims=True)
    points = np.concatenate([points + part for part in PARTS])
    faces = np.arange(6000, dtype=np.int32).reshape(-1, 3)
    originals = coverage_masks(points, faces, PROJECTIONS, 64, 64)[:, :, 0].copy()
    square = np.array([[-2.5, -2.5, 0.0], [2.5, -2.5, 0.0], [2.5, 2.5, 0.0], [-2.5, 2.5, 0.0]])
    soup = np.array([square[[0, 1, 2]], square[[0, 2, 3]]] * 8) + PARTS[0]
    views, room = RefineViews(PROJECTIONS, originals), Room.of(two_balls())
    search = Annealing(soup, room, views, Prices(UNIT // 2), 1)
    before = search.measure
    search.run(60 * TRIES, (0.0, 1.0))
    beside = np.abs(search.best()[:, :, 0].mean(axis=1) - PARTS[1, 0]) < RADIUS
    assert beside.sum() >= 3
    assert search.measure > 1.5 * before
