"""Where triangles that add little are put: by a plain count of gaps, and on a part that is bare."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from simplifier.geometry.room import Room
from simplifier.geometry.views import hemisphere_directions, image_axes
from simplifier.kernels.annealing import TRIES, _count_gaps, _place_anywhere
from simplifier.kernels.coverage import coverage_masks
from simplifier.kernels.soup_views import UNIT, all_contained
from simplifier.refinement.annealing import Annealing, Prices, RefineViews, cells_before
from tests.kernels.bits import blob, packed, unpacked
from tests.pictures import sphere_projections

SIZE = 24  # cells a side
VIEWS = 12
PROJECTIONS = sphere_projections(
    image_axes(hemisphere_directions(VIEWS)), np.full(3, SIZE / 2), SIZE / 2
)
LOOKS = 16  # of those that a count of gaps takes by lot
PARTS = np.array([[6.0, 12.0, 12.0], [18.0, 12.0, 12.0]])  # centres of two balls
RADIUS = 4.5


def two_balls():
    """(24, 24, 24) bool."""
    centres = np.moveaxis(np.indices((SIZE,) * 3), 0, -1) + 0.5
    return np.any([((centres - part) ** 2).sum(axis=-1) < RADIUS**2 for part in PARTS], axis=0)


def in_gap(point, view, original, union):
    """Whether a point falls on a pixel that is bare with all of its neighbours."""
    bare = ndimage.binary_erosion(
        unpacked(original) & ~unpacked(union), np.ones((3, 3)), border_value=0
    )
    column, row = np.floor(PROJECTIONS[view, :, :3] @ point + PROJECTIONS[view, :, 3]).astype(int)
    return bool(0 <= column < 64 and 0 <= row < 64 and bare[row, column])


@pytest.mark.parametrize("seed", range(4))
def test_gaps_are_counted_pixel_by_pixel(seed):
    """Over many draws the count is that of all views, each as often as any other."""
    rng = np.random.default_rng(seed)
    originals = np.stack([packed(blob(seed + view, 0.9)) for view in range(VIEWS)])
    layers = np.zeros((VIEWS, 3, 64), np.uint64)
    layers[:, 0] = [packed(blob(99 + seed + view, 0.15)) for view in range(VIEWS)]
    state = np.array([seed + 1], np.uint64)
    for _ in range(6):
        triangle = rng.uniform(6.0, 18.0, (3, 3))
        middle = triangle.mean(axis=0)
        places = zip(range(VIEWS), originals, layers[:, 0], strict=True)
        share = np.mean([in_gap(middle, *place) for place in places])
        found = [_count_gaps(triangle, PROJECTIONS, originals, layers, state) for _ in range(400)]
        assert np.mean(found) / LOOKS == pytest.approx(share, abs=0.04)
        assert share not in (0.0, 1.0) or set(found) == {round(LOOKS * share)}


def test_corners_are_drawn_until_they_are_in_the_room():
    """Of a small room in a large grid, where a corner by lot would seldom be."""
    room = Room.of(two_balls())
    there, trial = np.tile(PARTS[0], (1, 3, 1)), np.zeros((3, 3))
    there[0] += [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    state, before = np.array([7], np.uint64), cells_before(room)
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
