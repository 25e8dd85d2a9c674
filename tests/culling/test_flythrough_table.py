"""The CSV is strict and stable."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest

from simplifier.culling.flythrough import fly
from simplifier.culling.flythrough_rows import COLUMNS, TOTAL, flythrough_csv
from tests.culling.occluded import (
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    street,
    tree_of,
    wall_with_window,
)

PAGE = Path(__file__).parents[2] / "docs" / "culling.md"
SHARES = ("objects_recall", "parts_recall", "wrong_share")


@pytest.fixture(scope="module")
def flown():
    scene = street(wall_with_window())
    cameras = [looking(), looking(forward=(0.0, -1.0, 0.0)), looking((1.0, -8.0, 3.0))]
    return fly(scene, tree_of(scene, {"wall": exact(WALL)}), path_of(*cameras), SMALL)


def rows(data):
    assert b"\r" not in data
    header, *found = csv.reader(data.decode("ascii").splitlines(keepends=True), strict=True)
    assert tuple(header) == COLUMNS
    assert all(len(row) == len(header) for row in found)
    return [dict(zip(header, row, strict=True)) for row in found]


def test_a_row_a_frame_and_their_sums(flown):
    *frames, total = rows(flythrough_csv(flown))
    assert [row["frame"] for row in frames] == ["0", "1", "2"]
    assert total["frame"] == TOTAL
    for column in COLUMNS[1:]:
        if not total[column]:
            assert column.startswith(("pvs_", "both_", "outside_"))  # without visible sets
            assert not any(row[column] for row in frames)
        elif column not in SHARES:
            sums = sum(float(row[column]) for row in frames)
            assert float(total[column]) == pytest.approx(sums, abs=0.002), column
    for row in (*frames, total):
        for what in ("objects", "parts"):
            culled, hidden = int(row[f"{what}_culled"]), int(row[f"{what}_hidden"])
            assert int(row[f"{what}_missed"]) == hidden - culled
            assert row[f"{what}_recall"] == (f"{culled / hidden:.6f}" if hidden else "")
        share = int(row["wrong_pixels"]) / max(int(row["covered_pixels"]), 1)
        assert float(row["wrong_share"]) == pytest.approx(share, abs=1e-9)
    assert int(total["wrong_pixels"]) > 0
    assert frames[1]["parts_recall"] == ""  # looking back, nothing is hidden


def test_figures_of_a_frame(flown):
    row, figures = rows(flythrough_csv(flown))[0], flown.frames[0].figures
    assert row["parts_in_view"] == str(figures.parts.in_view)
    assert row["objects_wrong"] == str(figures.objects.wrong)
    assert row["occluder_triangles"] == "12"
    assert row["scene_triangles"] == str(flown.scene.triangle_counts.sum())
    assert row["milliseconds"] == f"{figures.milliseconds:.3f}"


def test_the_page_names_every_column():
    named = re.findall(r"^\| `(\w+)`", PAGE.read_text("utf-8"), flags=re.MULTILINE)
    assert tuple(named) == COLUMNS
