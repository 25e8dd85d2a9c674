"""Which cells are timed, and what that foretells."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simplifier.geometry.view_cells import ViewCells
from simplifier.visibility import cost
from simplifier.visibility.cost import CostMeter, batches


def row_of_cells(count):
    low = np.zeros((count, 3))
    low[:, 0] = np.arange(count)
    return ViewCells.boxes(low, low + 1.0)


@given(st.integers(0, 90), st.integers(1, 40), st.integers(0, 2**32 - 1))
def test_each_cell_comes_once_and_a_few_are_timed(count, size, seed):
    kept = np.flatnonzero(np.random.default_rng(seed).random(count) < 0.8)
    parts = list(batches(row_of_cells(count), kept, size))
    joined = np.concatenate([np.empty(0, np.int64), *(some for some, _ in parts)])
    assert sorted(joined.tolist()) == kept.tolist()
    timed = [some for some, is_timed in parts if is_timed]
    assert len(timed) == int(len(kept) > 1)
    assert all(4 <= len(some) <= 16 or len(some) == len(kept) - 1 for some in timed)


def test_the_timed_cells_are_spread_over_the_plan():
    parts = list(batches(row_of_cells(400), np.arange(400), 32))
    timed = parts[1][0]
    assert len(timed) == 16
    assert np.array_equal(timed // 25, np.arange(16))


def test_what_a_few_cells_took_is_foretold_of_all(monkeypatch):
    clock = iter([0.0, 10.0, 13.0, 15.0, 35.0])
    monkeypatch.setattr(cost.time, "perf_counter", lambda: next(clock))
    meter = CostMeter()
    meter.ready()  # after ten seconds
    meter.add(1, 24, timed=False)  # the first cell, for which things are made
    assert meter.came.seconds_a_cell == 3.0
    assert meter.foretold is None
    meter.add(4, 20, timed=True)
    assert meter.foretold == cost.Cost(0.5, 25.0, 4)
    meter.add(20, 0, timed=False)
    assert meter.came == cost.Cost(pytest.approx(22.0 / 24.0), 35.0, 24)
