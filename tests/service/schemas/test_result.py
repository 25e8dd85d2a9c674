"""Levels of a result, from the report and the files."""

from __future__ import annotations

import json

import simplifier
from service.jobs.job import Blob, Job, JobFile, JobKind, JobState
from service.schemas.job import JobBody
from service.schemas.result import Result
from tests.solids import box

JOB = Job(
    id="j1", number=1, tenant="local", kind=JobKind.OCCLUDER, state=JobState.SUCCEEDED,
    name="box.obj", options={}, version="1.0", created=0.0, attempt=1, attempts=3, ended=1.0,
)  # fmt: skip
QUICK = {"resolution": 12, "budget": 12, "preset": "draft", "views": 4, "image": 32, "quads": 100}


def result_of(**options) -> Result:
    """Of a real report, with two files a level."""
    product = simplifier.simplify(box(), simplifier.SimplifyOptions(**QUICK, **options)).measure()
    report = json.loads(json.dumps(product.report()))
    names = [
        f"lod{level}.{form}" for level in range(len(product.levels)) for form in ("glb", "obj")
    ]
    files = [JobFile(name, Blob("0" * 64, 1), "model/obj") for name in [*names, "report.json"]]
    return Result.of(JobBody.of(JOB, whole_webhook=True), report, files)


def test_a_single_level_has_the_figures_of_the_whole_report():
    result = result_of()
    (level,) = result.levels
    assert result.report["levels"] == []
    for name in ("triangles", "precision", "recall", "error_bound"):
        assert getattr(level, name) == result.report[name]
    assert level.overhang == result.report["overhang"]["share"]
    assert level.verdict == result.report["verdict"]["word"]
    assert (level.level, level.switch_distance) == (0, None)
    assert level.files == {
        "glb": "/v1/jobs/j1/files/lod0.glb", "obj": "/v1/jobs/j1/files/lod0.obj",
    }  # fmt: skip


def test_levels_have_a_row_each():
    result = result_of(lods=3)
    assert len(result.levels) == len(result.report["levels"]) > 1
    for level, row in zip(result.levels, result.report["levels"], strict=True):
        assert (level.level, level.recall) == (row["level"], row["recall"])
        assert level.overhang == row["overhang"]["share"]
        assert level.verdict == row["verdict"]["word"]
        assert level.files["obj"].endswith(f"/lod{level.level}.obj")


def test_what_has_no_levels_has_none():
    files = [JobFile("scene.zip", Blob("0" * 64, 1), "application/zip")]
    assert Result.of(JobBody.of(JOB, whole_webhook=True), None, files).levels == []
