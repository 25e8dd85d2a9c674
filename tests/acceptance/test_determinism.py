"""The same input, options and seed give the same bytes, wherever and on any number of threads."""

from __future__ import annotations

import hashlib

import pytest

import simplifier
from examples.castle import castle
from tests.acceptance.command import occluder

OPTIONS = {
    "cut alone": {"preset": "best", "moves": 0},
    "refined": {"preset": "balanced", "moves": 2000},
    "published": {"trim": "area", "moves": 0},
}
COMMON = {"budget": 40, "resolution": 24, "ground": True, "seed": 3}


def bytes_of(mesh, path, **options):
    simplifier.save(simplifier.simplify(mesh, **COMMON, **options).occluder, path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def mesh():
    return castle()


@pytest.mark.sweep(3)
@pytest.mark.parametrize("name", OPTIONS)
def test_any_number_of_threads(mesh, tmp_path, monkeypatch, name):
    results = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        results.append(bytes_of(mesh, tmp_path / "out.glb", **OPTIONS[name]))
    assert results[0] == results[1] == results[2]
    assert results[0] == bytes_of(mesh, tmp_path / "again.glb", **OPTIONS[name])


def test_another_process(mesh, tmp_path):
    source = tmp_path / "castle.ply"  # keeps float64, so the mesh is the same bit by bit
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), source)
    here = bytes_of(simplifier.load(source), tmp_path / "here.glb", moves=1000)
    target = tmp_path / "there.glb"
    done = occluder(
        "simplify", source, "-o", target, "--budget", "40", "--resolution", "24", "--ground",
        "--seed", "3", "--moves", "1000", "--views", "2", "--image", "16", "--quads", "1",
        OCCLUDER_THREADS="5", PYTHONHASHSEED="5",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert digest(target.read_bytes()) == digest(here)


def digest(data):
    return hashlib.sha256(data).hexdigest()


def test_reports_on_any_number_of_threads(mesh, monkeypatch):
    judged = simplifier.simplify(mesh, **COMMON, moves=0).occluder
    reports = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("OCCLUDER_THREADS", threads)
        for exact in (False, True):
            report = simplifier.evaluate(mesh, judged, views=16, image=64, exact=exact).accuracy
            reports.append((report.precision, report.recall, report.recall_by_view.tolist()))
    assert reports[:2] == reports[2:4] == reports[4:]


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".stl", ".off", ".tres"])
def test_files_hold_no_clock_and_no_chance(mesh, tmp_path, suffix):
    occluder_here = simplifier.Occluder(mesh.vertices[:90], mesh.faces[:12] % 90)
    simplifier.save(occluder_here, tmp_path / f"one{suffix}")
    simplifier.save(occluder_here, tmp_path / f"two{suffix}")
    one, two = ((tmp_path / f"{name}{suffix}").read_bytes() for name in ("one", "two"))
    assert one == two
