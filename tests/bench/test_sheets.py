"""The table of sheets, on one of them, and its page."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import bench.sheets
import simplifier
from bench.record import read_table, write_page
from bench.sheets import RESULTS, means, noise, sheets
from simplifier.kernels.thin import border_places


def test_every_sheet_is_open_and_the_noise_is_as_high_as_said():
    made = {name: mesh for name, mesh in sheets() if mesh is not None}
    assert len(made) >= 17
    for mesh in made.values():
        assert border_places(mesh.faces, len(mesh.vertices)).any()
    height = np.ptp(noise(1, 40, 2.5).vertices[:, 2])
    assert height == pytest.approx(6.0)


def test_means_are_of_terrains_of_others_and_of_all():
    figures = {"overhang": "0.1", "worst overhang": "1", "milliseconds": "50"}
    rows = [
        {"sheet": "terrain", "recall": "90", **figures},
        {"sheet": "terrain 1", "recall": "80", **figures},
        {"sheet": "flag", "recall": "40", **figures},
        {"mesh": "terrain", "note": "skipped"},
    ]  # fmt: skip
    assert [(row["sheet"], row["recall"]) for row in means(rows)] == [
        ("mean of terrains", "85.0"), ("mean of others", "40.0"), ("mean", "70.0"),
    ]  # fmt: skip


@pytest.mark.slow
def test_named_sheets_are_told_and_not_kept(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench.sheets, "RESULTS", tmp_path)
    monkeypatch.setattr(simplifier, "warm_up", lambda: None)
    bench.sheets.main(["flag", "--presets", "draft", "--budgets", "12,64", "--seeds", "1"])
    rows = capsys.readouterr().out.splitlines()
    assert [row.partition(", recall")[0] for row in rows[:2]] == [
        "draft sheet flag, budget 12", "draft sheet flag, budget 64",
    ]  # fmt: skip
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_all_of_them_are_kept_as_a_table_and_a_page(tmp_path, monkeypatch):
    monkeypatch.setattr(bench.sheets, "RESULTS", tmp_path)
    monkeypatch.setattr(simplifier, "warm_up", lambda: None)
    monkeypatch.setattr(
        bench.sheets, "sheets", lambda: iter([("terrain", None), ("flat", noise(1, 40, 4.0))])
    )
    bench.sheets.main(["--presets", "draft", "--budgets", "16", "--seeds", "1"])
    table = read_table(tmp_path / "sheets_draft.csv")
    assert table.rows[1][table.columns.index("sheet")] == "flat"
    assert float(table.rows[1][table.columns.index("recall")]) > 50.0
    assert "## draft" in (tmp_path / "sheets.md").read_text(encoding="utf-8")


def test_the_page_of_sheets_is_current(tmp_path):
    for path in RESULTS.glob("sheets_*.csv"):
        shutil.copy(path, tmp_path)
    page = write_page(tmp_path, "sheets", ("draft", "balanced", "best"))
    assert page.read_text(encoding="utf-8") == (RESULTS / "sheets.md").read_text(encoding="utf-8")
