"""Sweeps of rays over posts, against the same rays one by one."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from simplifier.kernels.line_sweep import sweep_fan


def plain_fan(eroded, line, place, height, ahead, size, lines, ends, cap):
    """What ``sweep_fan`` finds, for each ray and each column by itself."""
    pad = size + 2
    count, width = (length - 2 * pad for length in eroded.shape)
    rings = count - 1 - line if ahead > 0 else line
    found = np.full((lines.max() + 1, len(ends) - 1), cap)
    rays = -(-rings // size) + 1
    around = np.arange(-pad, width + pad)
    for ring in range(1, rings + 1):
        row = lines[line + ahead * ring]
        if row < 0:
            continue
        gap = 2.0 * ring / rays
        for column, (begin, end) in enumerate(pairwise(ends)):
            middle, spare = 0.5 * (begin + end), size - 0.5 * gap
            first = min(begin + spare, middle) - 0.5 * gap
            last = max(end - spare, middle) + 0.5 * gap
            # Those along the diagonals stand for what is just beyond.
            if begin < place + ring + size - 1e-6:
                first = min(first, place + ring)
            if end > place - ring - size + 1e-6:
                last = max(last, place - ring)
            for ray in range(rays + 1):
                slope = -1.0 + 2.0 * ray / rays
                at = place + slope * ring
                if not (-size - 1e-9 <= at <= width - 1 + size + 1e-9):
                    continue
                if not first - 1e-7 <= at <= last + 1e-7:
                    continue
                levels = [
                    np.interp(place + slope * k, around, eroded[line + ahead * k + pad])
                    for k in range(1, ring + 1)
                ]
                steepest = max((level - height) / k for k, level in enumerate(levels, 1))
                found[row, column] = min(found[row, column], height + steepest * ring)
    return found


@pytest.mark.parametrize("size", [1, 2])
@pytest.mark.parametrize("ahead", [1, -1])
@pytest.mark.parametrize("cap", [12.0, 1e9])
def test_a_fan_is_that_of_its_rays(size, ahead, cap):
    random = np.random.default_rng(size)
    for line, place in ((3, 5), (9, 2), (6, 10)):
        eroded = random.uniform(0.0, 9.0, (13 + 2 * (size + 2), 12 + 2 * (size + 2)))
        lines = np.full(13, -1, np.int32)
        lines[[1, 3]], lines[[5, 7]], lines[[9, 11]] = 0, 1, 2
        ends = np.array([0, 4, 8, 11])
        known = plain_fan(eroded, line, place, 4.0, ahead, size, lines, ends, cap)
        found = np.full(known.shape, cap)
        room = np.empty(20, np.int64), np.empty(20)
        sweep_fan(eroded, line, place, 4.0, ahead, size, lines, ends, cap, *room, found)
        assert np.allclose(found, known)
        assert (known < cap).any()
