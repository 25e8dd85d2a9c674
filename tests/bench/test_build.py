"""The check of many assets, on a few."""

from __future__ import annotations

from bench.build import check_times


def test_every_asset_is_current_when_it_is_checked():
    """``run_command`` fails where the command does, as a check of anything stale would."""
    (row,) = check_times([3], kib=1, repeats=1)
    assert (row["assets"], row["mesh_kib"]) == (3, 1)
    assert 0.0 < row["hashing_s"] < row["median_s"]
