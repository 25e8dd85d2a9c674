"""What is drawn of a report later is what was drawn with it."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

import simplifier
from tests.solids import sphere


@pytest.mark.parametrize("lods", [1, 2])
def test_a_report_is_drawn_later_as_with_its_result(tmp_path: Path, lods: int) -> None:
    mesh = sphere(rings=8)
    made = simplifier.simplify(
        mesh, budget=32, resolution=24, moves=20, views=8, image=64, lods=lods
    )
    measured = made.measure()
    report = json.loads(json.dumps(measured.report()))
    at_once = measured.write_pictures(tmp_path / "at once", "ball", report)
    (file, *_) = made.save(tmp_path / "ball.glb")
    occluder = simplifier.load_occluder(file)
    later = simplifier.draw_report(tmp_path / "later", mesh, occluder, report, name="ball")
    assert [path.name for path in later] == [path.name for path in at_once]
    for old, new in zip(at_once, later, strict=True):
        if old.suffix == ".html" or old.stem.startswith(("view", "silhouettes")):
            continue
        assert new.read_bytes() == old.read_bytes(), new.name  # histograms, of the same figures
    sheets = [cv2.imread(str(paths[0])).astype(np.int64) for paths in (at_once, later)]
    assert np.abs(sheets[0] - sheets[1]).mean() < 0.5  # of 255: corners were rounded
    pages = [paths[-1].read_text().partition("<img")[0] for paths in (at_once, later)]
    assert pages[0] == pages[1]
