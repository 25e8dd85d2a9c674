"""The check and the join of many assets, on a few."""

from __future__ import annotations

from bench.build import check_times, join_times


def test_every_asset_is_current_when_it_is_checked():
    """``run_command`` fails where the command does, as a check of anything stale would."""
    (row,) = check_times([3], kib=1, repeats=1)
    assert (row["assets"], row["mesh_kib"]) == (3, 1)
    assert 0.0 < row["hashing_s"] < row["median_s"]


def test_shards_are_checked_and_joined():
    (row,) = join_times([3], kib=1, repeats=1)
    assert (row["assets"], row["shards"]) == (3, 10)
    assert min(row["check_of_one_s"], row["join_s"]) > 0.0
