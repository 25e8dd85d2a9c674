"""Slices beside the oracle of the tests: what a small run tells."""

from __future__ import annotations

import pytest

from bench.visibility_oracle import oracle_rows


@pytest.mark.slow
def test_both_methods_are_told_for_each_scene_and_nothing_leaks():
    rows = [row for row in oracle_rows(dots=12, times=1) if row["voxel"] >= 0.5]
    assert {(row["scene"], row["method"]) for row in rows} == {
        (scene, method)
        for scene in ("two rooms", "staggered walls")
        for method in ("blocker extension", "slice-wise")
    }
    assert all(row["leaks"] == 0 for row in rows)
    assert all(1.0 <= row["sets_to_seen"] < 3.0 for row in rows)
