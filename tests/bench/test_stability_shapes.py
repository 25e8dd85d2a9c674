"""A row of the benchmarks at the extremes: an occluder's figures, or its refusal."""

from __future__ import annotations

from bench.record import read_table
from bench.stability import shapes
from bench.stability.produced import produced_row
from tests.extremes.shapes import one_triangle


def test_a_shape_is_measured_and_written(tmp_path, capsys):
    shapes.main(["--only", "one triangle", "--views", "4", "--out", str(tmp_path)])
    table = read_table(tmp_path / "stability_shapes.csv")
    row = dict(zip(table.columns, table.rows[0], strict=True))
    assert (row["shape"], row["triangles"], row["deviation"]) == ("one triangle", "1", "0.000")
    assert "| one triangle |" in capsys.readouterr().out


def test_a_refusal_is_a_row_of_its_own():
    row = produced_row(one_triangle(), {"options": "no time"}, 4, {"time_limit": 0.0})
    assert row["options"] == "no time"
    assert row["says"].startswith("refused: time limit: 0.0 is out of range")
