"""Kept figures beside new ones: what grew by a quarter is told, whatever the machine."""

from __future__ import annotations

import pytest

from bench import record, slower
from bench.reference import with_ratios


def table(folder, *rows):
    record.write_table(folder / "x.csv", rows, "me")
    return record.read_table(folder / "x.csv")


def row(preset, seconds, reference, **more):
    (found,) = with_ratios(
        [{"mesh": "m", "preset": preset, "median_s": seconds, **more}],
        {"median_s": "ratio"}, (reference, reference),
    )  # fmt: skip
    return found


def test_a_figure_that_grew_by_a_quarter_is_told(tmp_path):
    kept = table(tmp_path, row("draft", 1.0, 1.0), row("best", 4.0, 1.0))
    found = table(tmp_path, row("draft", 1.26, 1.0), row("best", 4.9, 1.0))
    assert list(slower.grown(kept, found)) == ["m, draft: ratio 1 -> 1.26, 1.26 times"]


def test_a_slower_machine_is_no_slower_program(tmp_path):
    kept, found = table(tmp_path, row("draft", 1.0, 0.5)), table(tmp_path, row("draft", 2.0, 1.0))
    assert list(slower.grown(kept, found)) == []
    found = table(tmp_path, row("draft", 1.0, 0.25))  # on a faster one, no faster
    assert len(list(slower.grown(kept, found))) == 1


def test_memory_and_floors_count_and_what_is_new_does_not(tmp_path):
    kept = table(tmp_path, {"kernel": "k", "times_floor": 2.0}, {"mesh": "m", "peak_mib": 100.0})
    found = table(
        tmp_path, {"kernel": "k", "times_floor": 2.5}, {"mesh": "m", "peak_mib": 99.0},
        {"mesh": "new", "peak_mib": 9.0, "note": "not there before"},
    )  # fmt: skip
    assert list(slower.grown(kept, found)) == ["k: times_floor 2 -> 2.5, 1.25 times"]


def test_rows_of_one_name_are_told_apart_by_their_order(tmp_path):
    """Files that had not changed were told to have grown: of rows alike, each beside the last."""
    rows = [{"mesh": "m", "peak_mib": one} for one in (9.0, 3.0)] + [{"ratio": 2.0}, {"ratio": 1.0}]
    kept = table(tmp_path, *rows)
    assert list(slower.grown(kept, kept)) == []
    rows[1]["peak_mib"], rows[3]["ratio"] = 6.0, 1.5
    assert list(slower.grown(kept, table(tmp_path, *rows))) == [
        "m, row 2: peak_mib 3 -> 6, 2.00 times", "row 2: ratio 1 -> 1.5, 1.50 times",
    ]  # fmt: skip


def test_rows_without_a_reference_stay_as_they_are():
    rows = [{"mesh": "m", "median_s": 1.0}, {"mesh": "n", "note": "skipped"}]
    assert with_ratios(rows, {"median_s": "ratio"}, (1.0, None)) == rows
    assert with_ratios(rows, {"median_s": "ratio"}, (1.0, 3.0)) == [
        {"mesh": "m", "median_s": 1.0, "ratio": 0.5}, rows[1],
    ]  # fmt: skip


@pytest.mark.parametrize(("took", "status"), [(1.0, 0), (2.0, 1)])
def test_it_compares_with_the_last_commit(tmp_path, monkeypatch, capsys, took, status):
    kept = table(tmp_path, row("draft", 1.0, 1.0))
    monkeypatch.setattr(slower, "RESULTS", tmp_path)
    monkeypatch.setattr(slower, "_kept", lambda path: kept if path.stem == "x" else None)
    table(tmp_path, row("draft", took, 1.0))
    record.write_table(tmp_path / "new.csv", [{"mesh": "m", "ratio": 9.0}], "me")
    assert slower.main([]) == status
    assert ("x: m, draft: ratio" in capsys.readouterr().out) == bool(status)


def test_what_was_never_kept_is_not_compared():
    assert slower._kept(slower.RESULTS / "nowhere.csv") is None
    assert slower._kept(slower.RESULTS / "fingerprints.csv").columns == ("what", "sha256")
