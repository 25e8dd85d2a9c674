"""The names that a script uses."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

import simplifier
from simplifier import api
from simplifier.errors import (
    BackendUnavailableError,
    CancelledError,
    EmptyMeshError,
    MeshError,
    OptionError,
    OutputError,
    UnknownFormatError,
    UnreadableMeshError,
)
from simplifier.progress import Deadline, Stopwatch
from tests.solids import blob, box

FAST = {"resolution": 12, "budget": 12, "preset": "draft", "moves": 200}


def test_from_arrays_to_a_file_and_back(tmp_path):
    mesh = simplifier.TriangleMesh.from_soup(box().vertices.tolist(), box().faces.tolist())
    occluder = simplifier.simplify(mesh, **FAST).occluder
    assert isinstance(occluder, simplifier.Occluder)
    assert occluder.vertices.dtype == np.float64
    assert occluder.faces.dtype == np.int32
    assert 0 < len(occluder.faces) <= 12
    path = tmp_path / "box.glb"
    simplifier.save(occluder, path)
    again = simplifier.load(path)
    assert again.vertices[again.faces] == pytest.approx(occluder.vertices[occluder.faces], abs=1e-6)
    report = simplifier.evaluate(mesh, occluder, views=16, image=64, exact=True).accuracy
    assert isinstance(report, simplifier.AccuracyReport)
    assert report.recall > 0.8
    assert report.options.views == 16


def test_paths_may_be_text(tmp_path):
    simplifier.save(simplifier.Occluder(box().vertices, box().faces), str(tmp_path / "a.obj"))
    assert len(simplifier.load(str(tmp_path / "a.obj")).faces) == 12


def test_results_are_read_only():
    occluder = simplifier.simplify(box(), **FAST).occluder
    for array in (occluder.vertices, occluder.faces):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1


def test_an_error_bound_in_place_of_a_resolution():
    occluder = simplifier.simplify(
        box(), error_bound=0.03, budget=11, preset="draft", moves=200
    ).occluder
    assert 0.02 < occluder.error_bound <= 0.03
    with pytest.raises(OptionError, match="8 cannot keep the error bound"):
        simplifier.simplify(box(), error_bound=0.03, resolution=8)


def test_options_as_an_object_and_as_keywords():
    options = simplifier.SimplifyOptions(**FAST, alpha=0.25)
    one = simplifier.simplify(box(), options, seed=3)
    other = simplifier.simplify(box(), **FAST, alpha=0.25, seed=3)
    assert one.options == other.options == simplifier.SimplifyOptions(**FAST, alpha=0.25, seed=3)
    assert one.stages.selection.alpha == 0.25  # an option once lost on its way
    assert one.occluder.vertices.tobytes() == other.occluder.vertices.tobytes()
    with pytest.raises(OptionError, match=r"^alfa: there is no such option; choose from budget"):
        simplifier.simplify(box(), alfa=0.1)
    with pytest.raises(OptionError, match=r"give simplifier\.SimplifyOptions"):
        simplifier.simplify(box(), simplifier.EvaluateOptions())


def test_every_error_is_an_occluder_error():
    kinds = (
        BackendUnavailableError, CancelledError, EmptyMeshError, MeshError, OptionError,
        OutputError, UnknownFormatError, UnreadableMeshError,
    )  # fmt: skip
    assert all(issubclass(kind, simplifier.OccluderError) for kind in kinds)
    error = MeshError("it is broken", where="a.obj", remedy="mend it")
    assert str(error) == "a.obj: it is broken; mend it"
    assert str(MeshError("it is broken")) == "it is broken"


@pytest.mark.parametrize(
    ("kind", "call"),
    [
        (UnreadableMeshError, lambda: simplifier.load("nowhere.obj")),
        (UnknownFormatError, lambda: simplifier.load("mesh.xyz")),
        (OptionError, lambda: simplifier.simplify(box(), budget=0).occluder),
        (OptionError, lambda: simplifier.simplify(box(), up="w").occluder),
        (OptionError, lambda: simplifier.simplify(box(), viewers="below").occluder),
        (OptionError, lambda: simplifier.evaluate(box(), no_occluder(), views=0).accuracy),
        (OptionError, lambda: simplifier.evaluate(box(), no_occluder(), viewers="below").accuracy),
        (OutputError, lambda: simplifier.save(no_occluder(), "occluder.xyz")),
    ],
)
def test_what_is_raised(kind, call):
    with pytest.raises(kind):
        call()


def no_occluder():
    return simplifier.Occluder(np.empty((0, 3)), np.empty((0, 3), dtype=np.int32))


@pytest.mark.parametrize("levels", [{}, {"lods": 2}], ids=str)
def test_what_is_compiled_first_is_part_of_no_stage_and_of_no_time_limit(monkeypatch, levels):
    """A first run told 17 seconds of voxels, and within a limit of two nothing was refined."""
    began, after, watch = [], Deadline.after, Stopwatch.__init__

    def deadline(*given):
        began.append("limit")
        return after(*given)

    def watched(self, *given):
        began.append("stages")
        watch(self, *given)

    monkeypatch.setattr(api, "load_for", lambda faces: began.append("compiled"))
    monkeypatch.setattr(Deadline, "after", deadline)
    monkeypatch.setattr(Stopwatch, "__init__", watched)
    made = simplifier.simplify(box(), budget=11, resolution=8, time_limit=0.1, **levels)
    assert began[0] == "compiled"
    assert {*began[1:]} == {"limit", "stages"}
    began.clear()
    simplifier.evaluate(box(), made.occluder, views=4, image=32, resolution=8)
    assert began == ["compiled", "stages"]


def test_an_occluder_made_elsewhere_promises_nothing():
    assert math.isinf(no_occluder().error_bound)
    report = simplifier.evaluate(box(), no_occluder(), views=4, image=32, quads=100).accuracy
    assert (report.precision, report.recall) == (1.0, 0.0)


def test_what_is_exported():
    assert set(simplifier.__all__) >= {"load", "simplify", "evaluate", "save", "OccluderError"}
    assert all(hasattr(simplifier, name) for name in simplifier.__all__)
    assert simplifier.__version__


LODS = {"resolution": 24, "preset": "draft", "moves": 300, "budget": 24}


def test_levels_of_detail_there_and_back(tmp_path):
    chain = simplifier.simplify(blob(), pixel_error=2.0, fov=45, **LODS, lods=3).chain
    assert isinstance(chain, simplifier.LodChain)
    assert len(chain.levels) + len(chain.left_out) == 3
    assert chain.at(0.0) is chain.levels[0]
    assert chain.at(math.inf) is chain.levels[-1]
    simplifier.save(chain, tmp_path / "blob.glb")
    back = simplifier.load_lods(tmp_path / "blob.glb")
    assert (back.lens, back.pixel_error) == (chain.lens, 2.0)
    assert [level.error_bound for level in back.levels] == [
        level.error_bound for level in chain.levels
    ]
    assert len(simplifier.load(tmp_path / "blob.glb").faces) == chain.levels[0].triangles


def test_levels_by_error_bounds():
    chain = simplifier.simplify(
        box(), error_bounds=[1.0, 0.3], budget=12, preset="draft", moves=0
    ).chain
    assert chain.levels[0].error_bound <= 0.3
    with pytest.raises(OptionError, match="error bounds: cannot be given together"):
        simplifier.simplify(box(), error_bounds=[1.0, 0.3], resolution=8)


def wall_and_boxes():
    """A wall along x, and two boxes behind it, one of them past its end."""
    wall = box((8.0, 4.0, 0.5), (-4.0, 0.0, 0.0))
    meshes = [wall, box((1.0, 1.0, 1.0), (0.0, 0.5, 3.0)), box((1.0, 1.0, 1.0), (9.0, 0.5, 3.0))]
    return simplifier.Scene(
        tuple(meshes), ("wall", "behind", "beside"), np.arange(3, dtype=np.int32),
        np.tile(np.eye(4), (3, 1, 1)),
    )  # fmt: skip


def test_a_scene_to_a_tree_to_verdicts(tmp_path):
    told = []
    tree = simplifier.simplify_scene(
        wall_and_boxes(), tmp_path, resolution=16, moves=200, preview=True,
        tell=lambda *done: told.append(done),
    )  # fmt: skip
    assert len(simplifier.load(tmp_path / "preview.glb").faces) > 0
    assert told[-1][0] == told[-1][1] > 0
    assert isinstance(tree, simplifier.OccluderTree)
    camera = simplifier.Camera.looking(
        np.array([0.5, 1.0, -6.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), 90.0, 0.1
    )
    culled = simplifier.Culler(tree, simplifier.DepthBuffer()).cull(camera)
    assert [simplifier.Verdict(v) for v in culled.verdicts] == [
        simplifier.Verdict.VISIBLE, simplifier.Verdict.HIDDEN, simplifier.Verdict.VISIBLE,
    ]  # fmt: skip
    again = simplifier.load_occluder_tree(tmp_path)
    assert again.objects == ("wall", "behind", "beside")


def test_a_scene_is_not_begun_when_it_is_cancelled(tmp_path):
    stop = threading.Event()
    stop.set()
    with pytest.raises(CancelledError):
        simplifier.simplify_scene(wall_and_boxes(), tmp_path, cancel=stop)
    assert not (tmp_path / "scene.json").exists()
