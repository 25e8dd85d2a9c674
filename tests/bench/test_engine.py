"""The C headers are compiled, timed and compared with Python on a small scene."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from bench import engine, rates
from simplifier.geometry.camera import Camera, CameraPath
from simplifier.io.occs_file import save_packed_tree
from tests.io.damaged_occs import town

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler here")


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Compiled once, which takes seconds."""
    return engine.compiled(tmp_path_factory.mktemp("engine"))


@pytest.fixture(autouse=True)
def quick(program, monkeypatch):
    """Timed once each."""
    monkeypatch.setattr(engine, "compiled", lambda folder: program)
    monkeypatch.setattr(rates, "_TIMINGS", 1)


def test_a_city_has_a_row_for_each_rasteriser_and_both_find_the_same(tmp_path, monkeypatch):
    monkeypatch.delenv("MOC_SOURCE", raising=False)
    rows = list(engine.raster_rows(tmp_path, heights=(1.7,)))
    assert [row["by"] for row in rows] == ["occluder_buffer.h", "Python"]
    assert all(row["draw_ms"] > 0.0 and row["test_ms"] > 0.0 for row in rows)
    assert rows[0]["hidden"] == pytest.approx(rows[1]["hidden"], abs=0.001)
    assert rows[0]["hidden"] > 0.9


def test_a_walk_has_a_row_for_each_budget(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "BUDGETS", (None, 1))
    save_packed_tree(town(), tmp_path / "town.occs")
    ahead, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    cameras = [Camera.looking(np.array([5e6 - x, 1, 1]), ahead, up, 60.0, 0.1) for x in (2.0, 9.0)]
    path = CameraPath("by hand", tuple(cameras))
    whole, one = engine.walk_rows(tmp_path, tmp_path / "town.occs", path)
    assert (whole["frames"], whole["budget"], one["budget"]) == (2, "none", 1)
    assert one["most_triangles"] <= 1 < whole["most_triangles"]
    assert whole["c_ms"] > 0.0
    assert whole["python_ms"] > 0.0
