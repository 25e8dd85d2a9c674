"""The loss map as a file, read back by the way that its keys are described."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path

import numpy as np
import pytest

import simplifier
from simplifier.accuracy.loss import measure_loss
from simplifier.errors import OptionError
from tests.solids import as_occluder, box, joined

MESH = joined(box(), box((1.0, 1.0, 1.0), (3.0, 0.0, 0.0)))
OCCLUDER = as_occluder(box())


def test_the_file_tells_the_loss_of_every_cell(tmp_path: Path) -> None:
    report = simplifier.evaluate(MESH, OCCLUDER, resolution=16, views=12, image=32).report()
    path = tmp_path / "loss.json"
    simplifier.save_loss_map(path, MESH, OCCLUDER, report)
    told = json.loads(path.read_text("utf-8"))
    lines = np.array([view["direction"] for view in report["by_view"]])
    found = measure_loss(MESH, OCCLUDER, lines)
    assert told["views"] == 12
    assert told["share"] == found.share
    assert told["centre"] == found.sphere.centre.tolist()
    assert told["radius"] == found.sphere.radius
    n = told["cells"]
    raw = np.frombuffer(zlib.decompress(base64.b64decode(told["data"])), dtype=np.uint8)
    loss, trust = np.moveaxis(raw.reshape(n, n, n, 2).transpose(2, 1, 0, 3), -1, 0)
    assert ((trust > 0) == (found.seen > 0)).all()
    known = found.seen > 0
    assert np.abs(loss[known] / 255.0 - found.shares[known]).max() <= 0.5 / 255.0
    assert path.stat().st_size < 60_000


def test_a_report_without_views_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="no views"):
        simplifier.save_loss_map(tmp_path / "loss.json", MESH, OCCLUDER, {})
    assert not list(tmp_path.iterdir())
