"""The library's calls give what the command writes, byte for byte."""

from __future__ import annotations

import json

import pytest

import simplifier
from tests.schema import check_report
from tests.solids import blob, box

CHOSEN = {
    "simplify": {"resolution": 24, "preset": "draft", "moves": 200, "budget": 24},
    "evaluate": {"resolution": 12},
}
FEW = {"views": 8, "image": 32, "exact": True, "seed": 3}


def words(chosen):
    """The options as they are typed."""
    for name, value in chosen.items():
        yield f"--{name}"
        if value is not True:
            yield str(value)


def write(shape, path):
    simplifier.save(simplifier.Occluder(shape.vertices, shape.faces), path)
    return path


@pytest.mark.parametrize("more", [{}, {"lods": 2}, {"ground": True, "viewers": "above"}])
def test_simplify(command, tmp_path, more):
    mesh, out, written = write(blob(), tmp_path / "m.ply"), tmp_path / "o.glb", tmp_path / "r.json"
    chosen = {**CHOSEN["simplify"], **FEW, **more}
    assert command("simplify", mesh, "-o", out, "--report", written, *words(chosen))[0] == 0
    by_command, contents = json.loads(written.read_text()), out.read_bytes()
    product = simplifier.simplify(
        simplifier.load(mesh), simplifier.SimplifyOptions.of(chosen)
    ).measure()
    report = product.report(
        load_seconds=1.5, write_seconds=0.5, files=product.save(out), names=(str(mesh), str(out))
    )
    assert out.read_bytes() == contents
    check_report(report)
    assert (report["timings"]["load"], report["timings"]["write"]) == (1.5, 0.5)
    assert report["timings"]["accuracy"] > 0.0
    assert {**report, "timings": 0} == {**by_command, "timings": 0}


def test_evaluate(command, tmp_path):
    mesh, wall = write(box(), tmp_path / "m.ply"), box((1.0, 1.0, 0.2), (0.0, 0.0, 0.4))
    occluder, written = write(wall, tmp_path / "o.ply"), tmp_path / "r.json"
    chosen = {**CHOSEN["evaluate"], **FEW}
    assert command("evaluate", mesh, occluder, "--report", written, *words(chosen))[0] == 0
    judgement = simplifier.evaluate(
        simplifier.load(mesh), simplifier.load_occluder(occluder),
        simplifier.EvaluateOptions.of(chosen),
    )  # fmt: skip
    by_command = json.loads(written.read_text())
    report = judgement.report(names=(str(mesh), str(occluder)))
    assert {**report, "timings": 0} == {**by_command, "timings": 0}
    pages = judgement.write_pictures(tmp_path / "pictures", "the box")
    assert "the box" in pages[-1].read_text()
