"""Files made later are those that would have been made at once, byte by byte."""

from __future__ import annotations

import json
import shutil
import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import simplifier
from service.engines.messages import Task
from service.engines.work.evaluation import evaluate_mesh
from service.engines.work.levels_file import load_levels, save_levels
from service.engines.work.occluder import make_occluder
from service.engines.work.on_demand import make_file
from service.engines.worker import TaskFailedError
from service.jobs.job import THUMBNAIL, JobKind, JobState, Summary
from service.jobs.on_demand import LOSS, is_page, made_of, needs_uploads, on_demand
from service.keep import Keep
from tests.solids import box, sphere

WORKS = {JobKind.OCCLUDER: make_occluder, JobKind.EVALUATION: evaluate_mesh}
DRAFT = {"preset": "draft", "resolution": 24, "moves": 200, "views": 8, "image": 64}
JUDGED = {"resolution": 24, "views": 8, "image": 64}
FAR = [1_234.56789, -987.654321, 10.00001]
"""An origin from which 32 bits keep a ten-thousandth."""


@dataclass
class Done:
    """A job of this process, as :class:`~service.jobs.on_demand.Made` wants it."""

    kind: JobKind
    summary: Summary
    folder: Path
    options: dict
    inputs: dict
    state: JobState = JobState.SUCCEEDED

    @property
    def files(self):
        results = self.folder / "results"
        return {
            path.relative_to(results).as_posix(): path.read_bytes()
            for path in results.rglob("*") if path.is_file()
        }  # fmt: skip

    def made(self, name, tmp_path):
        """The files that come of asking for one, from no more than is laid out for it."""
        place = tmp_path / name.replace("/", "-")
        inputs = dict(self.inputs) if needs_uploads(self, name) else {}
        inputs |= {
            one: str(self.folder / "results" / one)
            for one in made_of(name) if one in self.files
        }  # fmt: skip
        make_file(
            task(self.kind, self.options, inputs, place, wanted=name), tell, threading.Event()
        )
        results = place / "results"
        return {
            path.relative_to(results).as_posix(): path.read_bytes()
            for path in results.rglob("*") if path.is_file()
        }  # fmt: skip


def tell(progress):
    pass


def task(kind, options, inputs, folder, **more):
    for name in ("results", "scratch"):
        shutil.rmtree(folder / name, ignore_errors=True)
        (folder / name).mkdir(parents=True)
    return Task(
        kind, "ball.ply", options, inputs, str(folder / "results"), str(folder / "scratch"),
        1, 1 << 32, 1 << 30, **more,
    )  # fmt: skip


def done(kind, options, inputs, folder, keep):
    whole = task(kind, options, inputs, folder, keep=keep, pages=keep is Keep.ALL)
    summary = WORKS[kind](whole, tell, threading.Event())
    return Done(kind, summary, folder, options, inputs)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    path = tmp_path_factory.mktemp("mesh") / "ball.ply"
    ball = sphere(rings=8)
    simplifier.save(simplifier.Occluder(ball.vertices + FAR, ball.faces), path)
    return {"mesh": str(path)}


@pytest.fixture(scope="module")
def both(mesh, tmp_path_factory):
    """``both({"lods": 2})``: the job that kept all and the one that kept little, made once."""
    made = {}

    def of(options):
        key = json.dumps(options)
        if key not in made:
            folder, chosen = tmp_path_factory.mktemp("both"), {**DRAFT, **options}
            made[key] = [
                done(JobKind.OCCLUDER, chosen, mesh, folder / str(keep), keep)
                for keep in (Keep.ALL, Keep.LEAN)
            ]
        return made[key]

    return of


@pytest.mark.parametrize(
    "options",
    [{"lods": 2}, *(pytest.param(one, marks=pytest.mark.slow)
                    for one in ({"lods": 3}, {"lods": 1}, {"overhang": 0.0}, {}))],
)  # fmt: skip
def test_an_occluder_that_kept_little_gives_every_file_of_one_that_kept_all(
    both, tmp_path, options
):
    whole, lean = both(options)
    assert lean.files.keys() == {"occluder.glb", "levels.npz", "report.json"}
    assert lean.files["occluder.glb"] == whole.files["occluder.glb"]
    later = on_demand(lean, lean.files)
    views = {name for name in whole.files if name.startswith("pictures/view_")}
    # Lists of thousands of assets show thumbnails, and must not have each of them made.
    expected = {*whole.files.keys() - views - {THUMBNAIL}, "levels.npz", LOSS}
    assert {*later, *lean.files} == expected
    for name in later:
        made = lean.made(name, tmp_path / "made")
        if name == LOSS:
            assert made == whole.made(name, tmp_path / "again")
        elif not is_page(name):
            assert made == {name: whole.files[name]}
    pictures = lean.made("pictures/recall.png", tmp_path / "made")
    assert pictures.keys() == {name for name in whole.files if is_page(name)}
    for name in pictures.keys() - {"report.html"}:
        assert pictures[name] == whole.files[name]


def test_an_evaluation_keeps_its_report_alone(mesh, tmp_path):
    simplifier.save(simplifier.Occluder(box().vertices + FAR, box().faces), tmp_path / "box.obj")
    inputs = {**mesh, "occluder": str(tmp_path / "box.obj")}
    whole, lean = (
        done(JobKind.EVALUATION, JUDGED, inputs, tmp_path / str(keep), keep) for keep in Keep
    )
    assert lean.files.keys() == {"report.json"}
    for name in ("lod0.glb", "original.glb"):
        assert lean.made(name, tmp_path / "made") == {name: whole.files[name]}
    assert on_demand(whole, whole.files) == (LOSS,)
    told = json.loads(whole.made(LOSS, tmp_path / "made")[LOSS])
    assert 0.0 < told["share"] < 1.0
    pictures = lean.made("report.html", tmp_path / "made")
    assert pictures.keys() == {name for name in whole.files if is_page(name)}


def test_a_report_without_spaces_says_the_same(both):
    whole, lean = both({"lods": 2})
    told = [json.loads(one.files["report.json"]) for one in (whole, lean)]
    for one in told:
        del one["timings"]
    assert told[0] == told[1]
    assert len(lean.files["report.json"]) < 0.8 * len(whole.files["report.json"])


@pytest.mark.parametrize("options", [{"lods": 2}, {}])
def test_levels_come_back_to_the_last_bit(tmp_path, options):
    made = simplifier.simplify(sphere(rings=8), simplifier.SimplifyOptions(**DRAFT, **options))
    paths = [tmp_path / name for name in ("once.npz", "again.npz")]
    for path in paths:
        save_levels(made, path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    back = load_levels(paths[0])
    if made.chain is None:
        pairs = [(made.occluder, back)]
    else:
        assert (back.lens, back.pixel_error) == (made.chain.lens, made.chain.pixel_error)
        levels = list(zip(made.chain.levels, back.levels, strict=True))
        for one, other in levels:
            assert (one.resolution, one.deviation) == (other.resolution, other.deviation)
        pairs = [(one.occluder, other.occluder) for one, other in levels]
    for one, other in pairs:
        assert one.error_bound == other.error_bound
        assert np.array_equal(one.vertices, other.vertices)
        assert np.array_equal(one.faces, other.faces)
        assert (one.vertices.dtype, one.faces.dtype) == (other.vertices.dtype, other.faces.dtype)


def test_what_it_is_made_of_may_be_missing(mesh, tmp_path):
    with pytest.raises(TaskFailedError, match="no occluder was given"):
        make_file(
            task(JobKind.OCCLUDER, DRAFT, {}, tmp_path, wanted="lod0.obj"), tell, threading.Event()
        )
