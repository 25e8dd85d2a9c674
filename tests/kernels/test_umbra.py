"""The umbra over a raster, ray by ray, and what reaches out of it, object by object."""

from __future__ import annotations

import numpy as np
import pytest

from simplifier.kernels.umbra import lower_umbra, see_over
from simplifier.visibility.cull_maps.coded_field import in_squares


def by_rays(sample, ring, heights, free, umbra):
    """As ``lower_umbra``, with points of rays in place of steps along an axis."""
    px, py, eye = sample[:3]
    here = np.floor([px, py]).astype(int)
    umbra[tuple(here)] = -np.inf
    for across in np.arange(-ring, ring + 1) / ring:
        for way in ((1.0, across), (-1.0, across), (across, 1.0), (across, -1.0)):
            steepest = -np.inf
            for step in range(1, ring + 1):
                x, y = np.floor([px + step * way[0], py + step * way[1]]).astype(int)
                if not (0 <= x < heights.shape[0] and 0 <= y < heights.shape[1]):
                    break
                umbra[x, y] = min(umbra[x, y], eye + step * steepest)
                dropped = any(a <= x <= b and c <= y <= d for a, b, c, d in free)
                if not dropped:
                    steepest = max(steepest, (heights[x, y] - eye) / step)


@pytest.mark.parametrize("seed", range(4))
def test_umbra_of_a_sample(seed):
    random = np.random.default_rng(seed)
    heights = np.where(random.random((11, 8)) < 0.3, random.uniform(0.5, 9.0, (11, 8)), -np.inf)
    codes = np.where(heights > 0.0, 10.0 * heights, 0.0).astype(np.uint16)
    heights = np.where(codes > 0, codes, -np.inf)
    free = np.array([[2, 3, 5, 6]], dtype=np.int64)
    sample = np.array([*random.uniform(1.0, 7.0, 2), 20.0, 0.5, 0.0, 100.0])
    found, expected = np.full((2, 11, 8), np.inf)
    lower_umbra(sample, 16, in_squares(codes), free, found)
    by_rays(sample, 16, heights, free, expected)
    assert np.isfinite(expected).any()
    assert (np.isinf(expected) == np.isinf(found)).all()
    assert np.allclose(found, expected, atol=1e-9)


def test_what_reaches_out_of_an_umbra():
    random = np.random.default_rng(1)
    nx, ny, objects = 9, 7, 12
    counts = random.integers(0, 3, nx * ny)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    owners = random.integers(0, objects, starts[-1]).astype(np.int32)
    tops = random.uniform(0.0, 5.0, starts[-1]).astype(np.float32)
    umbra = random.uniform(2.0, 6.0, (4, 3))
    seen = np.zeros(objects, dtype=np.bool_)
    see_over(umbra, 2, 3, ny, starts, owners, tops, seen)
    expected = {
        int(owners[item])
        for x in range(4)
        for y in range(3)
        for item in range(starts[(x + 2) * ny + y + 3], starts[(x + 2) * ny + y + 4])
        if tops[item] > umbra[x, y]
    }
    assert set(np.flatnonzero(seen)) == expected
    assert 0 < len(expected) < objects
