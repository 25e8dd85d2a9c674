"""The benchmark of the C reader: what it makes is what it says, and every task is timed."""

from __future__ import annotations

import shutil

import pytest

from bench.visibility_reader import made_sets, reader_times


@pytest.mark.parametrize("run", [1, 5])
def test_as_many_objects_are_visible_as_are_asked_for(run):
    pvs = made_sets(9, 200, 30, run)
    assert [int(pvs.visible(cell).sum()) for cell in range(9)] == [30] * 9
    assert [len(pvs.slices.of(cell)) for cell in range(9)] == [30] * 9


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler here")
def test_every_task_is_timed():
    rows = list(reader_times(9, 200, 30))
    assert len(rows) == 14
    assert all(row["us"] > 0.0 for row in rows)
