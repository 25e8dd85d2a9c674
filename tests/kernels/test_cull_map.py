"""One sample's cull map, against the same rays followed plainly, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.kernels.cull_map import FIRST_RING, see_from, see_from_cells
from simplifier.visibility.cull_maps.coded_field import CodedField
from simplifier.visibility.cull_maps.erosion import Window
from simplifier.visibility.solid.height_field import HeightField


class Raster:
    """Heights that hide, and one object for each pixel that has a top.

    ``inner`` and ``tops`` (nx, ny) are the heights of codes: no lower, and no higher.
    """

    def __init__(self, inner, tops):
        there = np.isfinite(tops)
        starts = np.concatenate([[0], np.cumsum(there.ravel())]).astype(np.int32)
        self.count = int(starts[-1])
        self.numbers = np.where(there, starts[:-1].reshape(tops.shape), -1)
        field = HeightField(
            np.zeros(2), 1.0, np.ascontiguousarray(inner, dtype=np.float32), starts,
            np.arange(self.count, dtype=np.int32), tops[there].astype(np.float32),
            np.zeros((self.count, 2, 2)), 0.0, np.ones(self.count, np.bool_),
        )  # fmt: skip
        coded = CodedField(field)
        self.codes, self.pixels = coded.codes, coded.pixels
        self.levels, self.sizes = coded.pyramid
        self.solid = coded.erosion(Window.box(0, 0))
        self.inner = self.codes.solid(self.codes.down(field.inner)).astype(np.float64)
        self.object_codes = coded.object_codes
        self.tops = np.full(tops.shape, -np.inf)
        self.tops[there] = self.codes.heights(self.object_codes)
        rays = FIRST_RING
        while rays < 2 * max(tops.shape) + FIRST_RING:
            rays *= 2
        self.scratch = (
            np.empty(4 * (2 * rays + 1)), np.zeros(4 * (2 * rays + 1), np.bool_),
            np.empty(int(self.sizes[0, 1] * self.sizes[0, 2]), np.int32),
        )  # fmt: skip
        self.highest = coded.highest

    def sample(self, x, y, eye, ex=0.0, ey=0.0):
        return np.array([x, y, self.codes.place(eye), ex, ey, self.highest])

    def see(self, sample, free=()):
        """(n,) objects that the sample sees."""
        seen = np.zeros(self.count, np.bool_)
        boxes = np.array(free, dtype=np.int64).reshape(-1, 4)
        work = see_from(
            sample, self.solid, boxes, self.pixels, self.levels, self.sizes, self.scratch, seen,
        )  # fmt: skip
        return seen, work


def followed(raster, sample, free=()):
    """What the rays of the first ring see, without blocks."""
    px, py, eye = *sample[:2], raster.codes.heights(sample[2])
    nx, ny = raster.inner.shape
    seen = set()
    start = int(np.floor(px)), int(np.floor(py))
    if 0 <= start[0] < nx and 0 <= start[1] < ny:
        seen.add(int(raster.numbers[start]))
    heights = np.stack([raster.inner, raster.tops], axis=2) - eye
    for x0, x1, y0, y1 in free:
        heights[x0 : x1 + 1, y0 : y1 + 1, 0] = -np.inf
    for side in range(4):
        sign = 1 if side % 2 == 0 else -1
        for index in range(-FIRST_RING, FIRST_RING + 1):
            steepest = -np.inf
            for step in range(1, FIRST_RING + 1):
                aside = index / FIRST_RING * step
                x = int(np.floor(px)) + sign * step if side < 2 else int(np.floor(px + aside))
                y = int(np.floor(py + aside)) if side < 2 else int(np.floor(py)) + sign * step
                if not (0 <= x < nx and 0 <= y < ny):
                    break
                if heights[x, y, 1] > steepest * step - 1e-6:
                    seen.add(int(raster.numbers[x, y]))
                steepest = max(steepest, heights[x, y, 0] / step)
    return seen - {-1}


@pytest.mark.parametrize("seed", range(4))
def test_it_sees_what_plain_rays_see(seed):
    random = np.random.default_rng(seed)
    shape = (14, 17)
    tops = np.where(random.random(shape) < 0.5, random.uniform(0.0, 9.0, shape), -np.inf)
    inner = np.where(random.random(shape) < 0.6, tops - random.uniform(0.0, 1.0, shape), -np.inf)
    raster = Raster(inner, tops)
    free = [] if seed % 2 else [(3, 6, 2, 5), (10, 10, 0, 16)]
    place = random.uniform(-1.0, 15.0, 2) if seed == 3 else random.uniform(4.0, 10.0, 2)
    sample = raster.sample(*place, (2.0, 11.0, 5.0, 1.0)[seed])
    seen, _ = raster.see(sample, free)
    assert set(np.flatnonzero(seen).tolist()) == followed(raster, sample, free)


@pytest.mark.parametrize(("top", "seen"), [(8.875, False), (9.0, True), (9.125, True)])
def test_what_just_reaches_the_shadow_is_seen(top, seen):
    tops = np.full((16, 9), -np.inf)
    tops[6], tops[10, 4] = 5.0, top
    raster = Raster(np.where(tops == 5.0, tops, -np.inf), tops)
    found, _ = raster.see(raster.sample(2.5, 4.5, 1.0))
    assert found[raster.numbers[10, 4]] == seen


def long_way(tower, turns, wall=10.0, reach=8):
    """A wall at 100 pixels and a tower at 560, past the first ring; turned by right angles."""
    inner = np.full((640, reach), -np.inf)
    inner[100:103] = wall
    tops = inner.copy()
    tops[560, reach // 2] = tower
    return Raster(np.rot90(inner, turns), np.rot90(tops, turns))


PLACES = {0: (20.5, 4.5), 1: (3.5, 20.5), 2: (619.5, 3.5), 3: (4.5, 619.5)}


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize(("tower", "seen"), [(50.0, False), (58.0, True)])
def test_far_away_a_tower_is_seen_if_it_is_higher_than_the_shadow(turns, tower, seen):
    # The eye is 80 pixels before the wall: 2 + 8 / 80 x 540 = 56 at the tower.
    raster = long_way(tower, turns)
    found, (_, tests) = raster.see(raster.sample(*PLACES[turns], 2.0))
    x, y = np.argwhere(raster.tops == tower)[0]
    assert found[raster.numbers[x, y]] == seen
    assert tests > 0


@pytest.mark.parametrize(("top", "seen"), [(-1.0, True), (-40.0, False)])
def test_from_above_a_low_box_is_seen_past_the_wall_where_it_is_far(top, seen):
    inner = np.full((640, 8), -np.inf)
    inner[100:103] = 10.0
    tops = inner.copy()
    tops[400, 4] = top
    raster = Raster(inner, tops)
    found, _ = raster.see(raster.sample(20.5, 4.5, 15.0))
    shadow = 15.0 - 5.0 * 380 / 82
    assert (top > shadow) == seen
    assert found[raster.numbers[400, 4]] == seen


def test_cells_take_their_own_samples_and_free_pixels_and_one_raster_a_call():
    raster = long_way(50.0, 0, reach=4)
    open_field = long_way(50.0, 0, wall=-np.inf, reach=4)
    samples = np.array([raster.sample(20.5, 2.5, 2.0), raster.sample(21.5, 1.5, 2.0)])
    tower = raster.numbers[560, 2]

    def sets(shrunk, free, free_starts, starts=(0, 1, 2), cells=(0, 2)):
        seen, work = np.zeros((2, raster.count), np.bool_), np.zeros((2, 2), np.int64)
        see_from_cells(
            *cells, samples, np.array(starts), shrunk.solid,
            np.array(free, dtype=np.int64).reshape(-1, 4), np.array(free_starts), raster.pixels,
            raster.levels, raster.sizes, raster.scratch, seen, work,
        )  # fmt: skip
        return seen[:, tower].tolist(), (work[:, 0] > 0).tolist()

    wall, both, none = [(100, 102, 0, 3)], [True, True], [0, 0, 0]
    assert sets(raster, [], none) == ([False, False], both)
    assert sets(open_field, [], none) == ([True, True], both)
    assert sets(raster, wall, [0, 1, 1]) == ([True, False], both)
    assert sets(raster, wall, [0, 0, 1]) == ([False, True], both)
    # A cell without samples of this raster, and one that another call looks from.
    assert sets(open_field, [], none, (0, 0, 2)) == ([False, True], [False, True])
    assert sets(open_field, [], none, cells=(0, 1)) == ([True, False], [True, False])
