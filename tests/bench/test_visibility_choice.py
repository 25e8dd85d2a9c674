"""The benchmarks of what auto takes and of walks, in small cities."""

from __future__ import annotations

import pytest

from bench import visibility_choice, visibility_walks
from bench.visibility_cases import city, walkable_city


@pytest.mark.slow
def test_each_method_that_serves_is_beside_auto(monkeypatch):
    monkeypatch.setattr(visibility_choice, "CASES", {"town": lambda: city(3, 9)})
    monkeypatch.setattr(visibility_choice, "_LEFT_OUT", {"town": ("slice-wise",)})
    (row,) = visibility_choice.choice_rows(["town"], 6)
    assert (row["taken"], row["cells"]) == ("strong and cull-map", 6)
    assert "voxel-column_seconds" not in row  # it is no terrain
    assert "slice-wise_seconds" not in row
    assert row["auto_set"] < min(row["cull-map_set"], row["strong_set"])
    assert row["time_to_best"] >= 1.0
    assert row["foretold_to_came"] == row["foretold_seconds"] / row["came_seconds"] > 0.0
    assert row["came_seconds"] <= row["auto_seconds"]


def test_the_best_is_the_fastest_of_what_is_as_tight_and_as_sure(monkeypatch):
    monkeypatch.setattr(visibility_choice, "_mean_set", lambda found: found.size)

    class Found:
        def __init__(self, size, conservative):
            self.size, self.pvs = size, self
            self.conservative = conservative

    auto = Found(10.0, True)
    others = [(Found(10.1, True), 3.0), (Found(11.0, True), 1.0), (Found(5.0, False), 2.0)]
    assert visibility_choice._best(auto, 4.0, others) == 3.0
    assert visibility_choice._best(auto, 2.5, others) == 2.5
    assert visibility_choice._best(Found(10.0, False), 4.0, others) == 2.0


@pytest.mark.slow
def test_a_walk_draws_no_more_by_both_than_by_either(monkeypatch, capsys):
    walks = {"town": (lambda eye: walkable_city(3, eye), "street", 1.7)}
    monkeypatch.setattr(visibility_walks, "WALKS", walks)
    (row,) = visibility_walks.walk_rows(frames=12)
    assert (row["frames"], row["frames_outside"], row["wrong_pixels_pvs"]) == (12, 0, 0)
    assert row["both"] <= min(row["pvs"], row["occluders"]) < row["frustum"]
    assert row["cells"] < 60
    assert "walks: town, frames 6 of 12" in capsys.readouterr().out
