"""The report: as its schema says, strict JSON, whole or not at all."""

from __future__ import annotations

import copy
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from simplifier.accuracy.accuracy import (
    AccuracyOptions,
    evaluate_accuracies,
    evaluate_accuracy,
)
from simplifier.accuracy.overhang import measure_overhangs
from simplifier.accuracy.verdict import verdict_on
from simplifier.errors import OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.geometry.occluder import LeftOut, Level, LodChain, Occluder
from simplifier.options.stages import SolidOptions
from simplifier.progress import STAGES, Stopwatch
from simplifier.report.report import (
    build_report,
    left_out_rows,
    level_rows,
    verdict_figures,
    verdict_row,
    write_report,
)
from simplifier.steps.solid import solidify
from simplifier.version import VERSION
from tests.schema import SCHEMA, check_report
from tests.solids import box

OPTIONS = {
    "resolution": 8, "up": "y", "ground": True,
    "accuracy": {"views": 5, "image": 32, "quads": 100, "seed": 3, "exact": False},
}  # fmt: skip


def report_of(mesh, occluder, *, resolution=8, ground=True, **others):
    accuracy = evaluate_accuracy(mesh, occluder, AccuracyOptions(views=5, image=32, quads=100))
    solid = solidify(mesh, SolidOptions(resolution, "y", ground), Stopwatch())
    given = {"options": OPTIONS, "timings": {"load": 0.5, "cut": 0.25}, **others}
    return build_report(mesh, occluder, solid, accuracy, **given)


@pytest.fixture(scope="module")
def report():
    mesh = box((2.0, 1.0, 1.0), without=[2])
    smaller = box((1.0, 0.5, 0.5), (0.5, 0.25, 0.25))
    occluder = Occluder(smaller.vertices, smaller.faces, 0.75)
    return report_of(mesh, occluder, warnings=["a", "b"], seed=9)


def test_as_the_schema_says(report):
    check_report(report)
    check_report(json.loads(json.dumps(report, allow_nan=False)))


def test_the_schema_is_strict(report):
    """Each key that it names is missed when it is gone, and noticed when its type is wrong."""
    validator = jsonschema.Draft202012Validator(SCHEMA)
    validator.check_schema(SCHEMA)
    for key in SCHEMA["required"]:
        without = {k: v for k, v in report.items() if k != key}
        assert not validator.is_valid(without), key
        assert not validator.is_valid({**report, key: object()}), key
    for key in ("worst_view", "occlusion_measure", "input", "solid", "timings"):
        for inner in report[key]:
            broken = copy.deepcopy(report)
            del broken[key][inner]
            assert not validator.is_valid(broken), (key, inner)
        more = copy.deepcopy(report)
        more[key]["new"] = "text"
        assert not validator.is_valid(more), key
    assert validator.is_valid({**report, "new_at_the_top": 1})
    assert not validator.is_valid({**report, "recall": 83.5})


def test_keys_and_figures(report):
    assert report["schema_version"] == 1
    assert report["version"] == VERSION
    assert set(report) == set(SCHEMA["properties"])
    assert report["triangles"] == 12
    assert report["error_bound"] == 0.75
    assert report["options"] == OPTIONS
    assert report["warnings"] == ["a", "b"]
    assert report["seed"] == 9
    assert report["input"]["triangles"] == 10
    assert report["input"]["vertices"] == 8
    assert report["input"]["bounds"] == [[0.0, 0.0, 0.0], [2.0, 1.0, 1.0]]


def test_levels(report):
    """Rows as the schema says; without levels both lists are empty."""
    assert report["levels"] == report["left_out"] == []
    mesh = box()
    levels = tuple(
        Level(Occluder(mesh.vertices, mesh.faces[:count], bound), 8, 0.1)
        for count, bound in ((12, 0.25), (6, math.inf))
    )
    chain = LodChain(levels, left_out=(LeftOut(4, "it hides nothing"),))
    occluders = [level.occluder for level in levels]
    accuracies = evaluate_accuracies(mesh, occluders, AccuracyOptions(views=3, image=32))
    overhangs = measure_overhangs(mesh, occluders, accuracies[0].directions)
    verdicts = [
        verdict_row(verdict_on(verdict_figures(*one)), None)
        for one in zip(occluders, accuracies, overhangs, strict=True)
    ]
    files = [Path("a/x_lod0.glb"), Path("a/x_lod1.glb")]
    rows = level_rows(chain, accuracies, overhangs, verdicts, files)
    made = report_of(mesh, occluders[0], levels=rows, left_out=left_out_rows(chain))
    check_report(json.loads(json.dumps(made, allow_nan=False)))
    first, second = made["levels"]
    assert (first["level"], first["triangles"], first["file"]) == (0, 12, "x_lod0.glb")
    assert first["recall"] == accuracies[0].recall == 1.0
    assert (first["verdict"]["word"], first["overhang"]["share"]) == ("good", 0.0)
    assert second["verdict"]["reason"] == verdicts[1]["reason"] != first["verdict"]["reason"]
    assert first["switch_distance"] == chain.switch_distance(0)
    assert (second["error_bound"], second["switch_distance"]) == (None, None)
    assert made["left_out"] == [{"resolution": 4, "reason": "it hides nothing"}]
    validator = jsonschema.Draft202012Validator(SCHEMA)
    for key in first:
        without = {name: value for name, value in first.items() if name != key}
        assert not validator.is_valid({**made, "levels": [without]}), key
        assert not validator.is_valid({**made, "levels": [{**first, key: object()}]}), key


def test_views(report):
    assert len(report["by_view"]) == 5
    worst = report["worst_view"]
    assert worst["recall"] == min(view["recall"] for view in report["by_view"])
    assert {k: v for k, v in worst.items() if k != "index"} == report["by_view"][worst["index"]]


def test_stages_that_did_not_run_took_no_time(report):
    assert list(report["timings"]) == list(STAGES)
    assert report["timings"]["load"] == 0.5
    assert report["timings"]["refine"] == 0.0


def test_solid(report):
    solid = report["solid"]
    nx, ny, nz = solid["resolution"]
    assert max(solid["resolution"]) == 8
    assert solid["cell_size"] == pytest.approx(2.0 / 8.0, rel=1e-6)
    assert 0.0 < solid["inside_fraction"] <= 1.0
    (ground,) = solid["closed_by"]
    assert ground["by"] == "ground"
    hollow = (nx - 2) * (ny - 1) * (nz - 2)  # walls, and a lid
    assert ground["volume"] == pytest.approx(hollow * solid["cell_size"] ** 3, rel=0.3)


def test_dropped_triangles_are_told():
    nan = float("nan")
    vertices = [*box().vertices.tolist(), [nan, 0, 0]]
    faces = [*box().faces.tolist(), [0, 1, 8], [0, 0, 1], [2, 2, 2]]
    mesh = TriangleMesh.from_soup(vertices, faces)
    found = report_of(mesh, Occluder(box().vertices, box().faces))["input"]
    assert found["dropped"] == {
        "non_finite": 1, "repeated_index": 2, "zero_area": 0, "far_away": 0,
    }  # fmt: skip
    assert found["triangles"] == 12


def test_no_promise_and_no_triangles():
    empty = Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32), math.inf)
    report = report_of(box(), empty)
    check_report(report)
    assert report["error_bound"] is None
    assert report["triangles"] == 0
    assert (report["recall"], report["precision"]) == (0.0, 1.0)
    assert report["deviation"] == 0.0
    assert report["occlusion_measure"]["ratio"] == 0.0


def test_written_as_strict_json(tmp_path, report):
    path = tmp_path / "report.json"
    write_report(report, path)
    text = path.read_text()
    assert text.endswith("}\n")
    assert json.loads(text, parse_constant=pytest.fail) == report


def test_not_a_number_is_not_written(tmp_path, report):
    path = tmp_path / "report.json"
    path.write_text("old")
    with pytest.raises(ValueError, match="JSON compliant"):
        write_report({**report, "recall": math.nan}, path)
    assert path.read_text() == "old"


def test_a_folder_that_is_not_there(tmp_path, report):
    with pytest.raises(OutputError, match="there is no folder"):
        write_report(report, tmp_path / "nowhere" / "report.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("scale", [1e-90, 1e90])
def test_scales_far_from_one(scale):
    mesh = TriangleMesh.from_soup(box().vertices * scale, box().faces)
    report = report_of(mesh, Occluder(mesh.vertices, mesh.faces))
    check_report(json.loads(json.dumps(report, allow_nan=False)))
    assert report["recall"] == 1.0
    assert report["occlusion_measure"]["ratio"] == 1.0
