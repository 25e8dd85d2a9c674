"""The table of overhang, on one small mesh."""

from __future__ import annotations

import pytest

import bench.overhang
import simplifier
from bench.record import read_table
from tests.solids import sphere


@pytest.mark.slow
def test_a_row_of_one_mesh_and_the_spread_of_two_seeds(tmp_path, monkeypatch, capsys):
    ball = sphere(rings=12)
    simplifier.save(simplifier.Occluder(ball.vertices, ball.faces), tmp_path / "ball.ply")
    monkeypatch.setattr(bench.overhang, "ASSETS", tmp_path)
    monkeypatch.setattr(bench.overhang, "MESHES", {"ball.ply": (24, "y"), "absent.ply": (8, "y")})
    monkeypatch.setattr(bench.overhang, "RESULTS", tmp_path)
    monkeypatch.setattr(simplifier, "warm_up", lambda: None)
    bench.overhang.main(["--presets", "draft", "--overhangs", "0.01,1"])
    head, _, row = capsys.readouterr().out.splitlines()
    assert head == "| mesh, budget | draft, 0.01 | draft, 1 |"
    name, small, large = (cell.strip() for cell in row.strip("|").split("|"))
    assert name == "ball, 24"
    recalls = [float(cell.partition(" at ")[0]) for cell in (small, large)]
    beside = [float(cell.partition(" at ")[2].partition(" ")[0]) for cell in (small, large)]
    assert 30.0 < recalls[0] < recalls[1]
    assert 0.0 < beside[0] < 1.2
    assert beside[1] > beside[0]
    table = read_table(tmp_path / "overhang_0.01_1.csv")
    asked = table.columns.index("overhang")
    assert [float(one[asked]) for one in table.rows] == [0.01, 1.0]
    assert [float(one[table.columns.index("recall")]) for one in table.rows] == pytest.approx(
        recalls, abs=0.06
    )
    bench.overhang.main(["ball", "--presets", "draft", "--seeds", "2"])
    assert " to " in capsys.readouterr().out
