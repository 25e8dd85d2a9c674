"""Tables of shapes by number of triangles."""

from __future__ import annotations

import shutil

import pytest

import simplifier
from bench.by_budget import PRESETS, Shapes, arguments, means, run
from bench.quality import RESULTS
from bench.record import read_table, write_page
from tests.solids import box, sphere


@pytest.fixture
def shapes(monkeypatch):
    monkeypatch.setattr(simplifier, "warm_up", lambda: None)
    made = [("block", box()), ("ball", sphere(rings=8)), ("lost", None)]
    kind_of = {"block": "flat ones", "ball": "round ones", "flag": "flat ones"}
    return Shapes("things", lambda: iter(made), kind_of.get, lambda name: {"resolution": 16})


def test_means_are_of_each_kind_and_of_all(shapes):
    figures = {"overhang": "0.1", "worst overhang": "1", "milliseconds": "50"}
    rows = [
        {"thing": "block", "recall": "90", **figures},
        {"thing": "flag", "recall": "80", **figures},
        {"thing": "ball", "recall": "40", **figures},
        {"mesh": "lost", "note": "skipped"},
    ]  # fmt: skip
    assert [(row["thing"], row["recall"]) for row in means(shapes, rows)] == [
        ("mean of flat ones", "85.0"), ("mean of round ones", "40.0"), ("mean", "70.0"),
    ]  # fmt: skip
    assert [row["thing"] for row in means(shapes, rows[:2])] == ["mean of flat ones"]


def test_named_ones_are_told_and_not_kept(shapes, tmp_path, capsys):
    words = ["ball", "--presets", "draft", "--budgets", "4,32", "--seeds", "1"]
    run(shapes, arguments("Things.", (4,), words), tmp_path)
    rows = capsys.readouterr().out.splitlines()
    assert [row.partition(", recall")[0] for row in rows[:2]] == [
        "draft thing ball, budget 4", "draft thing ball, budget 32",
    ]  # fmt: skip
    assert list(tmp_path.iterdir()) == []


def test_all_of_them_are_kept_as_a_table_and_a_page(shapes, tmp_path):
    run(shapes, arguments("Things.", (12,), ["--presets", "draft", "--seeds", "2"]), tmp_path, "no")
    table = read_table(tmp_path / "things_draft.csv")
    named = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    assert [row["thing"] for row in named] == [
        "block", "ball", "", "mean of flat ones", "mean of round ones", "mean",
    ]  # fmt: skip
    assert float(named[0]["recall"]) > 99.0 > float(named[1]["recall"]) > 20.0
    assert named[2]["mesh"] == "lost"
    assert "no" in named[2]["note"]
    assert "--presets draft --seeds 2" in (tmp_path / "things.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["sheets", "props", "plates"])
def test_kept_pages_are_those_of_the_kept_tables(tmp_path, page):
    for path in RESULTS.glob(f"{page}_*.csv"):
        shutil.copy(path, tmp_path)
    made = write_page(tmp_path, page, (*PRESETS, "best"))
    assert made.read_text(encoding="utf-8") == (RESULTS / made.name).read_text(encoding="utf-8")
