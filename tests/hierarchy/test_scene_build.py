"""Whole builds: nothing made twice, the same bytes by any way, and no fault that lasts."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
from collections import Counter

import numpy as np
import pytest

from examples.city import city
from simplifier.errors import CancelledError, EmptyMeshError, OutputError
from simplifier.geometry.mesh import TriangleMesh
from simplifier.hierarchy import scene_build as building
from simplifier.hierarchy.node_plan import plan_occluders
from simplifier.hierarchy.parts import split_large
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import load_occluder_tree, occluder_store
from simplifier.hierarchy.tree import build_tree
from simplifier.options.scene import SceneOptions
from tests.acceptance.command import environment
from tests.hierarchy.builds import SLOW, built, files
from tests.hierarchy.scenes import QUICK, moved, reordered, scene_of, street, with_object
from tests.in_process_pool import InProcessPool
from tests.solids import box

STREET = street(24)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A folder with a finished build of the street; not to be changed."""
    folder = tmp_path_factory.mktemp("whole")
    built(STREET, folder)
    return folder


@pytest.fixture
def folder(whole, tmp_path):
    """One that may be."""
    for name, data in files(whole).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(data)
    return tmp_path


def test_a_small_city(tmp_path):
    scene = city(2)
    options = SceneOptions(budget=16, resolution=8, moves=10, pixel_error=50.0)
    build = built(scene, tmp_path, options)
    assert build.warnings == ()
    assert build.made == len(build.summaries) == len(files(tmp_path)) - 1
    assert sum(summary.triangles > 0 for summary in build.summaries.values()) > 3
    again = built(scene, tmp_path, options)
    assert (again.made, again.kept) == (0, build.made)


def test_a_second_build_makes_nothing_and_writes_the_same(folder):
    before = files(folder)
    told = []
    build = built(STREET, folder, tell=lambda done, total: told.append((done, total)))
    assert (build.made, build.kept) == (0, len(before) - 1)
    assert told == [(build.kept, build.kept)]
    assert files(folder) == before


def test_progress_is_told_of_every_occluder(tmp_path):
    told = []
    build = built(street(6), tmp_path, tell=lambda done, total: told.append((done, total)))
    assert told == [(done, build.made) for done in range(build.made + 1)]


def test_a_changed_object_costs_its_leaf_and_its_path(folder):
    mesh = STREET.meshes[1]
    bent = TriangleMesh.from_soup(mesh.vertices * [1.0, 1.0, 1.0 + 2.0**-40], mesh.faces)
    scene = with_object(STREET, 5, mesh=bent)
    build = built(scene, folder)
    on_path = [
        node for node, keys in enumerate(build.keys)
        if 5 in build.tree.below(node) and not build.tree.is_leaf[node] and keys.far
    ]  # fmt: skip
    jobs = plan_occluders(build.parts, build.tree, QUICK).jobs.values()
    planned = sum(job.kind == "inner" and 5 in job.parts for job in jobs)
    assert build.made == 2 + planned
    assert 0 < len(on_path) <= planned < 5
    # What is stale is gone: the path's old occluders, for the leaf's others still stand elsewhere.
    assert len(files(folder)) - 1 == len(build.summaries)


def test_another_order_of_objects_makes_nothing(folder):
    build = built(reordered(STREET, np.random.default_rng(0).permutation(24)), folder)
    assert build.made == 0


@pytest.mark.parametrize("threads", ["1", "2"])
def test_the_same_bytes_on_any_number_of_processes(whole, tmp_path, monkeypatch, threads):
    monkeypatch.setenv("OCCLUDER_THREADS", threads)
    monkeypatch.setattr(building, "_FEW_JOBS", 0)
    built(STREET, tmp_path)
    assert files(tmp_path) == files(whole)


def test_a_pool_makes_the_same_bytes(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(building, "LEAST_IN_POOL", 1)
    pool, said = InProcessPool(), []
    build = built(STREET, tmp_path, pool=pool, say=said.append)
    assert files(tmp_path) == files(whole)
    assert pool.done == build.made
    assert said == ["occluders are made in this process"]


def test_few_occluders_are_no_work_for_others(whole, folder):
    (folder / "occluders").joinpath(min((folder / "occluders").iterdir()).name).unlink()
    pool, said = InProcessPool(), []
    assert built(STREET, folder, pool=pool, say=said.append).made == 1
    assert pool.done == 0
    assert said == ["occluders are made on this machine: 1 to make, and others take 64 and more"]
    assert files(folder) == files(whole)
    assert built(STREET, folder, pool=pool, say=said.append).made == 0
    assert len(said) == 1


@pytest.mark.parametrize(
    "damaged",
    [
        lambda answer: answer[:0],
        lambda answer: answer[:1],
        lambda answer: answer[:-1],
        lambda answer: answer[:-1] + bytes([answer[-1] ^ 1]),
        lambda answer: answer.replace(b'"mesh": [[', b'"mesh": [9, ['),
        lambda answer: b"[]" + answer[answer.index(b"\n") :],
    ],
    ids=["nothing", "a byte", "all but one", "another bit", "no such mesh", "no such line"],
)
def test_an_occluder_that_arrives_damaged_is_left_out(tmp_path, monkeypatch, damaged):
    monkeypatch.setattr(building, "LEAST_IN_POOL", 1)
    pool = InProcessPool(lambda place, answer: damaged(answer) if place == 3 else answer)
    build = built(STREET, tmp_path, pool=pool)
    assert len(build.warnings) == 1
    assert "its occluder arrived damaged" in build.warnings[0]
    assert built(STREET, tmp_path).made == 1


def test_a_pool_places_jobs_by_their_memory():
    parts = split_large(STREET)
    plan = plan_occluders(parts, build_tree(parts.bounds, QUICK.width), QUICK)
    jobs = list(plan.jobs.values())
    needs = list(building._job_needs(parts, jobs, QUICK))
    assert all(need > 0 for need in needs)
    largest = jobs[int(np.argmax(needs))]
    assert largest.kind == "inner"


def test_killed_and_resumed_gives_the_same_bytes(tmp_path):
    cut, straight = tmp_path / "cut", tmp_path / "straight"
    with subprocess.Popen(
        [sys.executable, "-m", "tests.hierarchy.builds", cut],
        stdout=subprocess.PIPE, env=environment(OCCLUDER_THREADS="2"), text=True,
    ) as process:  # fmt: skip
        for line in process.stdout:
            done, total = map(int, line.split())
            if done >= 3:
                process.kill()
                break
    assert 0 < len(files(cut)) < total
    assert "scene.json" not in files(cut)
    resumed = built(street(20), cut, SLOW)
    assert resumed.kept >= 3
    assert built(street(20), straight, SLOW).made == resumed.made + resumed.kept
    assert files(cut) == files(straight)


@pytest.mark.parametrize("few", [0, 1000], ids=["processes", "here"])
def test_cancel_raises_and_keeps_what_was_made(tmp_path, monkeypatch, few):
    monkeypatch.setattr(building, "_FEW_JOBS", few)
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    cancel = threading.Event()

    def tell(done, total):
        if done == 2:
            cancel.set()

    with pytest.raises(CancelledError, match="kept"):
        built(STREET, tmp_path, tell=tell, cancel=cancel)
    kept = len(files(tmp_path))
    assert kept >= 2
    monkeypatch.undo()
    assert built(STREET, tmp_path).kept == kept


def test_cancelled_in_the_middle_of_one_it_is_not_kept(tmp_path):
    """The best so far stood under the key of the finished one, for ever."""
    options = SceneOptions(budget=8, resolution=12, moves=100_000_000)
    cancel = threading.Event()
    timer = threading.Timer(0.5, cancel.set)
    timer.start()
    with pytest.raises(CancelledError):
        built(street(2), tmp_path, options, cancel=cancel)
    near = [path for path in files(tmp_path) if path.endswith(".glb")]
    assert len(near) <= 2  # those that are the meshes themselves


def test_an_exception_of_the_listener_ends_all(tmp_path, monkeypatch):
    monkeypatch.setattr(building, "_FEW_JOBS", 0)
    monkeypatch.setenv("OCCLUDER_THREADS", "2")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def tell(done, total):
        if done == 1:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        built(STREET, tmp_path / "out", tell=tell)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]  # the packed scene is gone


@pytest.mark.parametrize("known", [True, False], ids=["known", "unknown"])
def test_a_damaged_occluder_is_made_again(folder, known):
    before = files(folder)
    paths = sorted((folder / "occluders").iterdir())
    paths[0].write_bytes(paths[0].read_bytes()[:200])
    paths[1].write_bytes(b"")
    paths[2].unlink()
    if not known:
        (folder / "scene.json").write_text("{")
    assert built(STREET, folder).made == 3
    assert files(folder) == before


def failing(scene, options, cancel, job):
    if job.kind == "far":
        raise ZeroDivisionError("a fault")
    return building_made(scene, options, cancel, job)


building_made = building._made


def test_one_that_fails_is_named_and_the_rest_is_built(tmp_path, monkeypatch):
    monkeypatch.setattr(building, "_made", failing)
    monkeypatch.setenv("OCCLUDER_THREADS", "1")
    build = built(STREET, tmp_path)
    assert len(build.warnings) == 2  # a mesh each
    assert all(
        warning.startswith("object ") and "no occluder (ZeroDivisionError: a fault)" in warning
        for warning in build.warnings
    )
    assert build.made == len(files(tmp_path)) - 1 > 4
    assert all(
        keys.far is None for keys, leaf in zip(build.keys, build.tree.is_leaf, strict=True) if leaf
    )
    assert json.loads((tmp_path / "scene.json").read_text())["warnings"] == list(build.warnings)
    load_occluder_tree(tmp_path)
    monkeypatch.undo()
    assert built(STREET, tmp_path).made == 2  # it is tried again


def test_an_object_without_extent_is_named(tmp_path):
    """Scaled so far down that all its points are one, in the world."""
    flat = moved(linear=np.eye(3) * 1e-300)
    others = [moved(x, 5.0) for x in range(0, 12, 3)]
    scene = scene_of([box()], [0] * 5, [flat, *others], ["speck", "a", "b", "c", "d"])
    build = built(scene, tmp_path)
    assert len(build.tree.bounds) >= 5
    assert load_occluder_tree(tmp_path).objects[0] == "speck"


def test_a_store_that_cannot_be_written_ends_it(tmp_path):
    store = occluder_store(tmp_path)
    store.folder.rmdir()
    with pytest.raises(OutputError):
        build_occluders(STREET, QUICK, store, {})


def test_a_scene_without_objects(tmp_path):
    with pytest.raises(EmptyMeshError, match="no object"):
        build_occluders(
            scene_of([box()], [], np.empty((0, 4, 4))), QUICK, occluder_store(tmp_path), {}
        )


def test_a_far_occluder_that_spares_nothing_is_not_used(whole):
    tree = load_occluder_tree(whole)
    counts = tree.triangle_counts()
    both = (tree.occluder_of >= 0).all(axis=1)
    assert (counts[both, 0] < counts[both, 1]).all()
    kinds = Counter(map(tuple, (tree.occluder_of >= 0).tolist()))
    assert kinds[True, True] > 0
