"""The library's work by real processes: from uploads to the files that results are made of."""

from __future__ import annotations

import io
import json
import os
import re
import signal
import subprocess
import sys
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

from bench.visibility_city import generated_city
from service.engines.engine import LIBRARY_WORK
from service.jobs.job import JobKind, JobState
from service.jobs.progress import LARGEST_PICTURE
from simplifier import Occluder, load_lods, load_occluder, save, simplify
from simplifier.io.scene_writer import write_scene
from tests.acceptance.command import environment
from tests.service.engines.workplace import Workplace
from tests.solids import box, sphere
from tests.waiting import until

MIB = 1 << 20
DRAFT = {"preset": "draft", "resolution": 24, "moves": 200, "views": 8, "image": 64}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """An engine with one warm process, as it takes seconds to get ready."""
    folder = tmp_path_factory.mktemp("place")
    settings = {"workers": 1, "job_memory": 256 * MIB, "draw_at_once": True}
    with Workplace(folder, LIBRARY_WORK, **settings).open() as place:
        yield place


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A sphere as an OBJ file."""
    path = tmp_path_factory.mktemp("ball") / "ball.obj"
    mesh = sphere(rings=8)
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    path.write_text("\n".join(lines))
    return path.read_bytes()


def occluder_job(place, data, suffix=".obj", name="ball <b>.obj", **options):
    files = {f"input/mesh{suffix}": data}
    id_ = place.submit_files(JobKind.OCCLUDER, files, {**DRAFT, **options}, name=name)
    return place.end_of(id_, 60.0)


def tells_no_path(place, texts):
    """Pictures aside: one in a hundred spells "/tmp" in base64."""
    words = [re.sub(r"data:image/[^\"')]*", "", text) for text in texts]
    return not any(str(place.folder) in text or "/tmp" in text for text in words)


def test_a_path_beside_a_picture_is_found(place):
    picture = '<img src="data:image/png;base64,AAAA/tmpAAAA">'
    assert tells_no_path(place, [picture])
    assert not tells_no_path(place, [picture + " /tmp/mesh.obj"])


def test_an_occluder_has_levels_in_all_formats_a_report_and_pictures(place, ball, tmp_path):
    job = occluder_job(place, ball, lods=2, overhang=1.0)
    results = place.results(job.id)
    report = json.loads(results["report.json"])
    levels = len(report["levels"])
    assert levels == job.summary.levels == 2
    formats = {f"lod{level}.{suffix}" for level in range(levels)
               for suffix in ("glb", "obj", "ply", "stl", "tres", "off")}  # fmt: skip
    made = {"occluder.glb", "original.glb", "report.json", "report.html"}
    assert formats | made <= set(results)
    assert {"pictures/silhouettes.png", "pictures/recall.png"} <= set(results)
    for name in ("occluder.glb", "lod1.ply"):
        (tmp_path / name).write_bytes(results[name])
    chain = load_lods(tmp_path / "occluder.glb")
    assert [level.triangles for level in chain.levels] == [
        level["triangles"] for level in report["levels"]
    ]
    assert len(load_occluder(tmp_path / "lod1.ply").faces) == report["levels"][1]["triangles"]
    assert [level["file"] for level in report["levels"]] == ["lod0.glb", "lod1.glb"]
    assert all(0.0 < level["recall"] <= 1.0 for level in report["levels"])


def test_the_summary_says_what_the_report_says(place, ball):
    job = occluder_job(place, ball, lods=1)
    report, summary = json.loads(place.results(job.id)["report.json"]), job.summary
    assert (summary.precision, summary.recall) == (report["precision"], report["recall"])
    assert (summary.triangles, summary.input_triangles) == (report["triangles"], 16 * 16 - 32)
    assert summary.worst_recall == report["worst_view"]["recall"]
    assert summary.overhang == report["overhang"]["share"]
    told = report["verdict"]
    assert (summary.verdict, summary.reason, summary.try_next) == (
        told["word"], told["reason"], told["next"],
    )  # fmt: skip
    assert summary.error_bound == report["error_bound"]
    assert summary.timings == report["timings"]
    assert 0.0 < sum(summary.timings.values()) <= summary.seconds


def test_the_page_escapes_the_name_and_nothing_tells_a_path_of_this_machine(place, ball):
    job = occluder_job(place, ball, lods=1)
    results = place.results(job.id)
    page = results["report.html"].decode()
    assert "ball &lt;b&gt;.obj" in page
    assert tells_no_path(place, [page, results["report.json"].decode(), repr(job.summary)])


def test_one_level_where_it_keeps_wholly_inside(place, ball):
    job = occluder_job(place, ball, conservative=True)
    assert (job.state, job.summary.levels) == (JobState.SUCCEEDED, 1)
    assert {"occluder.glb", "lod0.tres"} <= set(place.results(job.id))


@pytest.mark.sweep(2)
@pytest.mark.parametrize("up", ["y", "z"])
def test_a_job_that_refines_for_long_sends_pictures_of_the_best_so_far(place, ball, up):
    told = []
    files, options = {"input/mesh.obj": ball}, {**DRAFT, "time_limit": 2.5, "up": up}
    del options["moves"]
    id_ = place.submit_files(JobKind.OCCLUDER, files, options, name="ball.obj", wake=False)
    stop = place.board.listen(id_, lambda _: told.append(place.board.latest(id_)))
    place.engine.wake()
    assert place.end_of(id_, 60.0).state is JobState.SUCCEEDED
    stop()
    pictures = {one.picture.number: one.picture.png for one in told if one and one.picture}
    assert list(pictures) == list(range(1, len(pictures) + 1))
    assert 1 <= len(pictures) <= 4  # once a second at most
    for png in pictures.values():
        image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
        assert image.shape == (160, 160, 3)
        yellow = (image[..., ::-1] == (250, 200, 30)).all(axis=-1)
        assert yellow.mean() > 0.3  # of a picture that the ball fills
        assert len(png) <= LARGEST_PICTURE


def test_a_job_that_does_not_refine_sends_none(place, ball):
    told = []
    files, options = {"input/mesh.obj": ball}, {**DRAFT, "moves": 0}
    id_ = place.submit_files(JobKind.OCCLUDER, files, options, name="ball.obj", wake=False)
    stop = place.board.listen(id_, lambda _: told.append(place.board.latest(id_)))
    place.engine.wake()
    assert place.end_of(id_, 60.0).state is JobState.SUCCEEDED
    stop()
    assert {one.picture for one in told if one} == {None}


SWEEP = {"resolutions": [8], "directions": [4], "budgets": [8], "times": [0.05], "repeats": 1}


DRAWN = b"""[[box]]
name = "a post beside the ball"
center = [3.0, 0.0, 0.0]
size = [0.5, 0.5, 0.5]

[[open]]
name = "the upper half"
center = [0.0, 1.0, 0.0]
size = [3.0, 2.0, 3.0]
"""


def overridden_job(place, mesh, overrides, label="ball.overrides.toml", kind=JobKind.OCCLUDER,
                   more=None, **options):  # fmt: skip
    files = {"input/mesh.obj": mesh, "input/overrides.toml": overrides, **(more or {})}
    labels = {"input/overrides.toml": label} if label else {}
    options = {"resolution": 24, "views": 8, "image": 64, **options}
    id_ = place.submit_files(kind, files, options, name="ball.obj", labels=labels)
    return place.end_of(id_, 60.0)


def test_overrides_are_kept_and_named_as_their_owner_names_them(place, ball, tmp_path):
    job = overridden_job(place, ball, DRAWN, preset="draft", moves=50, lods=2)
    assert job.state is JobState.SUCCEEDED, job.failure
    results = place.results(job.id)
    report = json.loads(results["report.json"])
    assert report["options"]["overrides"] == {
        "drawn": ["a post beside the ball"], "triangles": 12, "open": ["the upper half"],
        "viewers": 0,
    }  # fmt: skip
    told = "a post beside the ball (ball.overrides.toml:1) sticks out of the mesh by"
    assert told in " ".join(report["warnings"])
    assert told in " ".join(job.summary.warnings)
    assert tells_no_path(place, [results["report.html"].decode(), repr(report), repr(job.summary)])
    for level in range(job.summary.levels):
        (tmp_path / "one.obj").write_bytes(results[f"lod{level}.obj"])
        made = load_occluder(tmp_path / "one.obj")
        corners = made.vertices[made.faces]
        post = (np.abs(corners - [3.0, 0.0, 0.0]) < 0.2501).all(axis=(1, 2))
        assert post.sum() == 12
        assert len(post) > 12  # and something in the half that is not open
        assert corners[~post][..., 1].max() < 0.01


def test_what_they_ignore_is_not_there(place):
    keep, flag = box(), box(low=(0.0, 5.0, 0.0))
    lines = [f"v {x} {y} {z}" for x, y, z in [*keep.vertices, *flag.vertices]]
    for name, one in (("keep", 1), ("flag_2", 9)):
        lines += [f"o {name}", *(f"f {a + one} {b + one} {c + one}" for a, b, c in keep.faces)]
    mesh, ignore = "\n".join(lines).encode(), b'[ignore]\nmeshes = ["flag*"]\n'
    job = overridden_job(place, mesh, ignore, preset="draft", moves=0, lods=1)
    assert job.state is JobState.SUCCEEDED, job.failure
    assert job.summary.input_triangles == 12
    theirs = {"input/occluder.obj": obj_of(box()).encode()}
    judged = overridden_job(place, mesh, ignore, kind=JobKind.EVALUATION, more=theirs)
    assert judged.summary.input_triangles == 12
    assert judged.summary.recall > 0.95
    assert "flag" in " ".join(judged.summary.warnings)


def test_an_evaluation_tells_what_passes_through_an_open_region(place, ball):
    theirs = {"input/occluder.obj": ball}
    job = overridden_job(place, ball, DRAWN, kind=JobKind.EVALUATION, more=theirs)
    assert "the open region the upper half (ball.overrides.toml:6)" in " ".join(
        job.summary.warnings
    )
    assert tells_no_path(place, [repr(job.summary)])


@pytest.mark.parametrize(
    ("overrides", "label", "kind", "words"),
    [
        (b"[[box]]\ncentre = 1\n", "a.overrides.toml", "invalid-overrides",
         "a.overrides.toml:2: there is no key 'centre' in [[box]]"),
        (b"[[box]\n", None, "invalid-overrides", "overrides.toml:1: this is no TOML"),
        (b"\xff", "a.toml", "invalid-overrides", "a.toml:1: is not UTF-8"),
        (b'\n[ignore]\nmeshes = ["flag"]\n', "a.toml", "invalid-overrides", "a.toml:3: "),
        (DRAWN.replace(b"[3.0, 0.0", b"[0.0, 0.5"), "a.toml", "invalid-overrides",
         "a.toml:1: 'a post beside the ball' reaches into the open region the upper half"),
        (DRAWN, "a.toml", "invalid-options", "12 that the overrides draw"),
    ],
)  # fmt: skip
def test_refused_overrides_name_their_line(place, ball, overrides, label, kind, words):
    job = overridden_job(place, ball, overrides, label, budget=3)
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, kind, 1)
    assert words in job.failure.detail
    assert job.failure.remedy
    assert tells_no_path(place, [job.failure.detail, job.failure.remedy])


def test_a_tradeoff_measures_settings_and_tells_how_many_are_done(place, tmp_path):
    cube = box()
    save(Occluder(cube.vertices, cube.faces), tmp_path / "cube.obj")
    files = {"input/mesh.obj": (tmp_path / "cube.obj").read_bytes()}
    whole = {**SWEEP, "budgets": [len(cube.faces)]}  # it is its own occluder: nothing is searched
    id_ = place.submit_files(JobKind.TRADEOFF, files, whole, name="cube <b>.obj")
    job = place.end_of(id_, 60.0)
    assert (job.state, job.summary.levels) == (JobState.SUCCEEDED, 6)
    results = place.results(id_)
    assert set(results) == {f"tradeoff.{suffix}" for suffix in ("csv", "html", "json", "png")}
    settings = json.loads(results["tradeoff.json"])["settings"]
    assert {row["mesh"] for row in settings} == {"cube <b>.obj"}
    assert job.summary.recall == max(
        row["recall"] for row in settings if row["standing"] == "front"
    )
    assert job.summary.overhang in [row["overhang"] for row in settings]
    assert tells_no_path(place, [results["tradeoff.html"].decode(), repr(job.summary)])


def test_overrides_hold_for_a_tradeoff(place, ball):
    files = {"input/mesh.obj": ball, "input/overrides.toml": DRAWN}
    id_ = place.submit_files(JobKind.TRADEOFF, files, {**SWEEP, "budgets": [8]}, name="ball.obj")
    job = place.end_of(id_, 60.0)
    assert job.failure.detail.startswith("no setting could be measured: ")
    assert "12 that the overrides draw" in job.failure.detail


def test_a_tradeoff_ends_when_it_is_cancelled(place, ball):
    slow = {**SWEEP, "times": [60.0], "repeats": 1000}
    id_ = place.submit_files(JobKind.TRADEOFF, {"input/mesh.obj": ball}, slow, name="ball.obj")
    until(lambda: place.jobs.job(None, id_).state is JobState.RUNNING)
    place.jobs.cancel(None, id_)
    place.engine.wake()
    assert place.end_of(id_, 10.0).state is JobState.CANCELLED


EXTERNAL = json.dumps(
    {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "../secret.bin", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
    }
).encode()


@pytest.mark.parametrize(
    ("data", "suffix", "options", "kind", "words"),
    [
        (b"solid nothing", ".glb", {}, "unreadable-mesh", "cat.x: "),
        (b"v 0 0 0\nf 1 2 x\n", ".obj", {}, "unreadable-mesh", "cat.x: line 2"),
        (b"v 0 0 0\n", ".obj", {}, "unreadable-mesh", "cat.x: "),
        (b"whatever", ".fbx", {}, "unreadable-mesh", "'.fbx'"),
        (EXTERNAL, ".gltf", {}, "unreadable-mesh", "cat.x: "),
        (None, ".obj", {"budget": 0}, "invalid-options", "budget: 0"),
        (None, ".obj", {"colour": "red"}, "invalid-options", "colour"),
        (None, ".obj", {"smallest_hole": 100.0}, "invalid-options", "longer than the mesh"),
    ],
)
def test_refusals_say_what_the_reader_found(place, ball, data, suffix, options, kind, words):
    job = occluder_job(place, ball if data is None else data, suffix, name="cat.x", **options)
    assert (job.state, job.failure.kind, job.attempt) == (JobState.FAILED, kind, 1)
    assert words in job.failure.detail
    assert job.failure.remedy
    assert tells_no_path(place, [job.failure.detail, job.failure.remedy])


def test_too_fine_a_grid_ends_for_want_of_memory_and_the_next_job_is_done(place, asset, ball):
    data = asset("bunny_4968.ply").read_bytes()
    job = occluder_job(place, data, ".ply", resolution=512, ground=True)
    assert (job.failure.kind, job.attempt) == ("out-of-memory", 1)
    assert "256 MiB" in job.failure.detail
    assert occluder_job(place, ball).state is JobState.SUCCEEDED


def end_of_cancelled(place, id_):
    place.jobs.cancel(None, id_)
    place.engine.wake()
    return place.end_of(id_).state


def test_cancel_ends_reading_a_large_mesh(place, asset):
    files = {"input/mesh.ply": asset("dragon_871k.ply").read_bytes()}
    id_ = place.submit_files(JobKind.OCCLUDER, files, {}, name="heavy")
    until(lambda: place.job(id_).state is JobState.RUNNING)  # it begins by reading
    assert end_of_cancelled(place, id_) is JobState.CANCELLED


def test_a_long_search_hears_that_it_is_cancelled(place, ball, monkeypatch):
    monkeypatch.setattr("service.engines.attempt._PATIENCE", 600.0)  # the work ends itself
    files = {"input/mesh.obj": ball}
    options = {"preset": "best", "resolution": 24, "moves": 50_000_000}
    id_ = place.submit_files(JobKind.OCCLUDER, files, options, name="heavy")
    until(lambda: (now := place.board.latest(id_)) and now.stage == "refine")
    assert end_of_cancelled(place, id_) is JobState.CANCELLED


def test_an_evaluation_judges_what_was_made_elsewhere(place, ball, tmp_path):
    save(
        simplify(sphere(rings=8), budget=32, resolution=24, moves=0).occluder,
        tmp_path / "theirs.stl",
    )
    files = {
        "input/mesh.obj": ball,
        "input/occluder.stl": (tmp_path / "theirs.stl").read_bytes(),
    }
    options = {"resolution": 24, "views": 8, "image": 64}
    id_ = place.submit_files(JobKind.EVALUATION, files, options, name="ball.obj")
    job = place.end_of(id_)
    results = place.results(id_)
    report = json.loads(results["report.json"])
    assert (job.summary.recall, job.summary.levels) == (report["recall"], 1)
    assert job.summary.recall > 0.3
    assert {"report.html", "pictures/silhouettes.png"} <= set(results)
    assert {"original.glb", "lod0.glb"} <= set(results)  # to be looked at


def scene_zip(**files):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            archive.writestr(name.replace("__", "/"), data)
    return target.getvalue()


def obj_of(mesh):
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces)])


def scene_job(place, data, suffix, **options):
    files = {f"input/scene{suffix}": data}
    options = {"budget": 8, "resolution": 16, "moves": 0, **options}
    return place.end_of(place.submit_files(JobKind.SCENE, files, options, name="town.zip"), 60.0)


def test_a_scene_has_its_tree_occluders_and_all_in_one_archive(place):
    data = scene_zip(
        town__readme=b"passed over", **{"town__cat.stl": b"no mesh"},
        **{"town__a.obj": obj_of(box()), "town__b.obj": obj_of(box(low=(3.0, 0.0, 0.0)))},
    )  # fmt: skip
    job = scene_job(place, data, ".zip")
    results = place.results(job.id)
    document = json.loads(results["scene.json"])
    assert len(document["objects"]) == 2
    assert job.summary.input_triangles == 24
    assert job.summary.levels == len(document["occluders"]) > 0
    assert "cat.stl" in " ".join(job.summary.warnings)
    assert set(results) == {"scene.json", "scene.occs", "preview.glb", "scene.zip"}
    assert results["scene.occs"].startswith(b"\x89OCS\r\n\x1a\n")
    packed = zipfile.ZipFile(io.BytesIO(results["scene.zip"]))
    occluders = {one["file"] for one in document["occluders"].values()}
    assert set(packed.namelist()) == {"scene.json", "scene.occs", "preview.glb"} | occluders
    assert packed.read("scene.json") == results["scene.json"]
    assert tells_no_path(place, [results["scene.json"].decode(), repr(job.summary)])


@pytest.mark.parametrize(
    ("data", "suffix", "options", "kind", "words"),
    [
        (b"PK no zip", ".zip", {}, "unreadable-mesh", "no zip that can be read"),
        (scene_zip(**{"..__a.obj": b"v"}), ".zip", {}, "unreadable-mesh", "lies outside"),
        (scene_zip(readme=b"no mesh"), ".zip", {}, "unreadable-mesh", "town.zip: "),
        (scene_zip(readme=b"x"), ".zip", {"width": 1}, "invalid-options", "width: 1"),
        (scene_zip(readme=b"x"), ".zip", {"wide": 1}, "invalid-options", "wide: "),
        (EXTERNAL, ".gltf", {}, "unreadable-mesh", "town.zip: "),
    ],
)
def test_refused_scenes(place, data, suffix, options, kind, words):
    job = scene_job(place, data, suffix, **options)
    assert (job.failure.kind, job.attempt) == (kind, 1)
    assert words in job.failure.detail
    assert tells_no_path(place, [job.failure.detail, job.failure.remedy])


def sets_job(place, data, suffix, **options):
    options = {"up": "z", "cell_size": 20.0, **options}
    files = {f"input/scene{suffix}": data}
    return place.end_of(place.submit_files(JobKind.VISIBILITY, files, options, name="town"), 60.0)


@pytest.mark.slow
def test_sets_of_an_elevation_model(place):
    posts = io.BytesIO()
    np.save(posts, np.add.outer(np.zeros(9), 30.0 * np.sin(np.arange(9.0))))
    job = sets_job(place, posts.getvalue(), ".npy", up="y", spacing=[10.0, 10.0], tile=2)
    assert job.state is JobState.SUCCEEDED
    assert json.loads(place.results(job.id)["view/plan.json"])["up"] == "z"
    job = sets_job(place, posts.getvalue(), ".npy")
    assert (job.failure.kind, "spacing" in job.failure.detail) == ("invalid-options", True)
    assert job.failure.remedy == "give the spacing, DX,DY in world units"


def test_sets_that_need_too_much_memory_are_refused_before_work(place, tmp_path):
    write_scene(generated_city(2), tmp_path / "town.glb")
    town = (tmp_path / "town.glb").read_bytes()
    job = sets_job(place, town, ".glb", epsilon=0.02)
    assert (job.failure.kind, job.attempt) == ("out-of-memory", 1)
    assert job.failure.remedy.startswith("choose an epsilon of at least ")
    assert job.failure.remedy.endswith(", or raise OCCLUDER_JOB_MEMORY")
    assert job.ended - job.started < 5.0


@pytest.mark.slow
def test_a_search_for_sets_hears_that_it_is_cancelled(place, tmp_path, monkeypatch):
    monkeypatch.setattr("service.engines.attempt._PATIENCE", 600.0)  # the work ends itself
    write_scene(generated_city(2), tmp_path / "town.glb")
    files = {"input/scene.glb": (tmp_path / "town.glb").read_bytes()}
    options = {"up": "z", "epsilon": 0.5, "cell_size": 1.0}
    id_ = place.submit_files(JobKind.VISIBILITY, files, options, name="town")
    until(lambda: (now := place.board.latest(id_)) and now.stage == "sets", 30.0)
    assert end_of_cancelled(place, id_) is JobState.CANCELLED
    assert place.results(id_) == {}


@pytest.mark.parametrize(
    ("data", "suffix", "words"),
    [(b"no array", ".npy", "town"), (b"II*\0", ".tif", "town"), (EXTERNAL, ".gltf", "town")],
)
def test_refused_scenes_of_sets(place, data, suffix, words):
    job = sets_job(place, data, suffix, spacing=[1.0, 1.0] if suffix == ".npy" else None)
    assert job.failure.kind == "unreadable-mesh"
    assert words in job.failure.detail
    assert tells_no_path(place, [job.failure.detail, job.failure.remedy])


def test_a_server_needs_nothing_heavy():
    script = (
        "import sys; import service.engines.engine\n"
        "print([m for m in ('numpy', 'numba', 'scipy', 'simplifier') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment(),
        cwd=Path(__file__).parents[3], check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "[]"


SERVER = """
import sys, time
from pathlib import Path
from tests.service.engines.workplace import Workplace
with Workplace(Path(sys.argv[1])).open() as place:
    place.submit("hang", note=sys.argv[2])
    place.submit("hang", note=sys.argv[2])
    print("open", flush=True)
    time.sleep(600)
"""


@pytest.mark.parametrize("end", ["kill -9", "ctrl-c"])
def test_no_worker_outlives_its_server(tmp_path, end):
    note = tmp_path / "note"
    server = subprocess.Popen(
        [sys.executable, "-c", SERVER, str(tmp_path), str(note)], stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, cwd=Path(__file__).parents[3], start_new_session=True,
        env={**environment(), "PYTHONPATH": str(Path(__file__).parents[3])},
    )  # fmt: skip
    with server:
        try:
            until(lambda: note.exists() and len(note.read_text().split()) == 2)
            workers = [Path(f"/proc/{pid}") for pid in note.read_text().split()]
            if end == "ctrl-c":  # which a terminal sends to all that it sees
                os.killpg(server.pid, signal.SIGINT)
            else:
                server.kill()
            server.wait(10.0)
        finally:
            server.kill()
        until(lambda: not any(worker.exists() for worker in workers), 5.0)
