"""What eyes at some places see of a grid: lines past touched voxels, and cells in fine grids."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.voxel import sight
from simplifier.voxel.sight import seen_from

SIZE = 6


def crosses(start, end, low):
    """(n,) bool: through which open unit cubes at ``low`` (n, 3) a segment passes, by its slabs'
    overlap.
    """
    run = end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (low - start) / run, (low + 1.0 - start) / run
    enters = np.where(run == 0.0, -np.inf, np.minimum(one, two))
    leaves = np.where(run == 0.0, np.inf, np.maximum(one, two))
    within = (run != 0.0) | ((start > low) & (start < low + 1.0))
    first, last = enters.max(axis=1).clip(min=0.0), leaves.min(axis=1).clip(max=1.0)
    return within.all(axis=1) & (first < last)


def seen_plainly(touched, eyes):
    """(SIZE,) * 3 bool, line by line."""
    walls = np.argwhere(touched).astype(float)
    seen = np.zeros_like(touched)
    for place in np.argwhere(~touched):
        for eye in eyes:
            others = walls[(walls != np.floor(eye)).any(axis=1)]
            seen[tuple(place)] |= not crosses(place + 0.5, eye, others).any()
    return seen


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.floats(0.05, 0.5))
def test_a_voxel_is_seen_by_who_has_a_free_line_to_its_centre(seed, count, share):
    rng = np.random.default_rng(seed)
    touched = rng.random((SIZE,) * 3) < share
    eyes = rng.uniform(-2.0, SIZE + 2.0, (count, 3))
    found = seen_from(touched, ~touched, eyes)
    assert np.array_equal(found, seen_plainly(touched, eyes))


def test_only_candidates_are_looked_for_and_nobody_sees_nothing():
    free = np.ones((4, 4, 4), dtype=np.bool_)
    eyes = np.array([[2.5, 2.5, 2.5]])
    wanted = np.zeros_like(free)
    wanted[0] = True
    assert np.array_equal(seen_from(~free, wanted, eyes), wanted)
    assert not seen_from(~free, free, np.empty((0, 3))).any()


def test_eyes_along_the_axes_and_in_a_touched_voxel():
    touched = np.zeros((5, 5, 5), dtype=np.bool_)
    touched[2, 2, 2] = touched[2, 2, 4] = True
    within = np.array([[2.5, 2.5, 2.5]])
    seen = seen_from(touched, ~touched, within)
    assert seen[2, 2, 3]
    assert seen[0, 2, 2]
    assert seen[4, 4, 4]
    beyond = seen_from(touched, ~touched, np.array([[2.5, 2.5, 9.5]]))
    assert not beyond[2, 2, :4].any()
    assert beyond[1, 1, 3]


@pytest.mark.parametrize("seed", range(3))
def test_fine_grids_are_judged_by_cells(seed, monkeypatch):
    """Two rooms, a thick wall and a door: as voxel by voxel, but for a cell's width."""
    rng = np.random.default_rng(seed)
    touched = np.zeros((48, 24, 24), dtype=np.bool_)
    touched[[0, -1]] = touched[:, [0, -1]] = touched[:, :, [0, -1]] = True
    touched[23:27] = True
    touched[23:27, 8:16, :16] = False
    eyes = np.array([[12.5, 12.5, 10.5]]) + rng.uniform(-2.0, 2.0, (4, 3))
    free = ~touched
    plain = seen_from(touched, free, eyes)
    monkeypatch.setattr(sight, "_PLAIN", 24)
    coarse = seen_from(touched, free, eyes)
    assert not (coarse & touched).any()
    assert coarse[1:23, 1:-1, 1:-1].all()
    assert plain[1:23, 1:-1, 1:-1].all()
    wrong = (coarse != plain).sum()
    assert 0 < plain[27:].sum() < free[27:].sum()
    assert wrong < 0.25 * free[27:].sum()
