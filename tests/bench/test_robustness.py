"""The table of what seeds, turns and budgets do."""

from __future__ import annotations

import numpy as np
import pytest

import bench.robustness
import simplifier
from tests.solids import box, sphere


def test_turns_are_eight_and_keep_every_length():
    mesh = box((1.0, 2.0, 3.0))
    turned = list(bench.robustness.turns(mesh))
    assert len({one.vertices.tobytes() for one in turned}) == 8
    for one in turned:
        edges = (np.linalg.norm(m.vertices[m.faces[:, 0]] - m.vertices[m.faces[:, 1]], axis=1)
                 for m in (one, mesh))  # fmt: skip
        np.testing.assert_allclose(*edges, rtol=1e-12)


@pytest.mark.slow
def test_a_row(tmp_path, monkeypatch, capsys):
    ball = sphere(rings=12)
    path = tmp_path / "ball.ply"
    simplifier.save(simplifier.Occluder(ball.vertices, ball.faces), path)
    monkeypatch.setattr(bench.robustness, "readable_assets", lambda: [(path, None)])
    bench.robustness.main(["ball"])
    row = capsys.readouterr().out.splitlines()[-1].strip("|").split("|")
    name, seeds, turned, *budgets = (cell.strip() for cell in row)
    assert name == "ball"
    for cell in (seeds, turned):
        least, most = map(float, cell.split(" to "))
        assert 60.0 < least <= most <= 100.0
    assert sorted(map(float, budgets)) == [float(value) for value in budgets]
