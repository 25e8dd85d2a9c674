"""An occluder against its mesh, as one call."""

from __future__ import annotations

import threading

import pytest

import simplifier
from simplifier import CancelledError, EvaluateOptions, OptionError
from tests.schema import check_report
from tests.solids import box

CHOSEN = {"resolution": 12, "views": 8, "image": 32, "exact": True}


def wall():
    solid = box((1.0, 1.0, 0.2), (0.0, 0.0, 0.4))
    return simplifier.Occluder(solid.vertices, solid.faces)


def test_what_it_says():
    judgement = simplifier.evaluate(box(), wall(), EvaluateOptions.of(CHOSEN))
    report = judgement.report(load_seconds=2.0)
    check_report(report)
    assert report["timings"]["load"] == 2.0
    assert report["error_bound"] is None
    assert judgement.accuracy.precision == report["precision"] > 0.99
    assert 0.0 < judgement.accuracy.recall == report["recall"] < 1.0


def test_it_can_be_cancelled():
    stop = threading.Event()
    stop.set()
    with pytest.raises(CancelledError):
        simplifier.evaluate(box(), wall(), cancel=stop)


def test_a_hole_longer_than_the_mesh_is_found_with_the_mesh():
    with pytest.raises(OptionError, match=r"smallest hole: 9.0 is longer than the mesh"):
        simplifier.evaluate(box(), wall(), EvaluateOptions(smallest_hole=9.0))
