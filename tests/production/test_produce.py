"""A run as one call: what the command writes, without the command."""

from __future__ import annotations

import copy
import pickle
import threading

import numpy as np
import pytest

import simplifier
from simplifier import CancelledError, OptionError, SimplifyOptions
from simplifier.accuracy.overhang import measure_overhang
from simplifier.wording import percent_at_most
from tests.schema import check_report
from tests.solids import blob, box

QUICK = {"resolution": 16, "preset": "draft", "moves": 200, "budget": 24}
FEW = {"views": 8, "image": 32, "exact": True}


def produced(mesh, listener=None, cancel=None, **options):
    return simplifier.simplify(
        mesh, SimplifyOptions.of({**QUICK, **FEW, **options}), listener=listener, cancel=cancel
    ).measure(listener)


def test_a_single_occluder_is_a_chain_of_one(tmp_path):
    mesh = blob()
    product = produced(mesh)
    (level,), (accuracy,) = product.levels, product.accuracies
    alone = simplifier.simplify(mesh, **QUICK).occluder
    assert level.occluder.vertices.tobytes() == alone.vertices.tobytes()
    assert level.triangles == len(alone.faces)
    assert level.error_bound == alone.error_bound
    assert 0.0 <= level.deviation <= level.error_bound
    assert 0.0 < accuracy.recall <= 1.0
    assert product.mesh is mesh
    assert not product.interrupted
    assert product.save(tmp_path / "a.ply") == (tmp_path / "a.ply",)
    assert len(simplifier.load(tmp_path / "a.ply").faces) == level.triangles


def test_every_level_has_its_figures(tmp_path):
    product = produced(blob(), resolution=32, lods=3, budget=32)
    report = product.report()
    check_report(report)
    assert len(report["levels"]) == len(product.levels) == len(product.accuracies) >= 2
    for index, row in enumerate(report["levels"]):
        level, accuracy = product.levels[index], product.accuracies[index]
        assert row["triangles"] == level.triangles
        assert (row["precision"], row["recall"]) == (accuracy.precision, accuracy.recall)
        assert row["error_bound"] == level.error_bound
        assert row["switch_distance"] == product.chain.switch_distance(index)
        assert row["file"] is None
    files = product.save(tmp_path / "blob.glb")
    assert [row["file"] for row in product.report(files=files)["levels"]] == [
        file.name for file in files
    ]
    pages = product.write_pictures(tmp_path / "pictures", "the blob")
    assert "not written" in pages[-1].read_text()


def test_what_stands_before_much_says_so_and_what_helps():
    rough = produced(blob(), overhang=1.0)
    (told,) = (words for words in rough.warnings if "well behind" in words)
    assert told.startswith(f"{percent_at_most(rough.front.mean)} of the visible mesh")
    assert told in rough.report()["warnings"]
    assert rough.front.mean > 0.05
    finer = produced(blob(), overhang=0.002, resolution=64, moves=2000)
    assert 0.0 < finer.front.mean < 0.05
    assert not any("well behind" in words for words in finer.warnings)


def test_every_level_has_a_verdict_and_an_overhang():
    product = produced(blob(), resolution=32, lods=3, budget=32)
    report = product.report()
    assert report["verdict"]["word"] == product.verdict.word == product.verdicts[0].word
    assert product.overhang is product.overhangs[0]
    alone = measure_overhang(
        product.mesh, product.levels[-1].occluder, product.accuracies[0].directions
    )
    assert product.overhangs[-1].mean == alone.mean
    for row, overhang, verdict in zip(
        report["levels"], product.overhangs, product.verdicts, strict=True
    ):
        assert row["overhang"]["share"] == overhang.mean
        assert (row["verdict"]["word"], row["verdict"]["reason"]) == (verdict.word, verdict.reason)
    told = [line for line in product.warnings if line.startswith("level ")]
    assert len(told) == sum(one.word == "unusable" for one in product.verdicts[1:])


def test_an_aim_that_the_user_set_and_missed_makes_it_weak():
    missed = produced(blob(), min_precision=1.0, overhang=0.1, budget=200, image=256)
    assert missed.precision < 1.0
    assert missed.verdict.word != "good"
    assert "below the target of 100 %" in missed.verdict.reason
    assert not any("target" in line for line in missed.warnings)


def test_pictures_are_of_the_name(tmp_path):
    files = produced(box()).write_pictures(tmp_path, "box <1>")
    assert {file.name for file in files} == {file.name for file in tmp_path.iterdir()}
    assert "box &lt;1&gt;" in (tmp_path / "report.html").read_text()


def test_stages_are_told_in_order():
    told = []
    produced(box(), told.append)
    stages = list(dict.fromkeys(one.stage for one in told))
    assert stages == [one for one in simplifier.STAGES if one in stages]
    assert stages[0] == "voxelize"
    assert (told[-1].stage, told[-1].share) == ("accuracy", 1.0)


def test_a_cancel_before_there_is_something_raises():
    stop = threading.Event()
    stop.set()
    with pytest.raises(CancelledError):
        produced(box(), cancel=stop)


def test_a_cancel_while_refining_keeps_the_best_so_far():
    stop = threading.Event()

    def listen(progress):
        if progress.stage == "refine":
            stop.set()

    product = produced(box(), listen, stop, budget=11, moves=100_000_000)
    assert product.interrupted
    # What is found so soon may stick out too far, which is another warning.
    assert product.warnings[0] == "interrupted: this is the best occluder so far"
    assert len(product.accuracies) == 1
    check_report(product.report())


def test_what_is_made_can_be_saved_before_it_is_judged(tmp_path):
    made = simplifier.simplify(box(), SimplifyOptions.of({**QUICK, **FEW}))
    made.save(tmp_path / "box.glb")
    again = made.measure()
    assert len(simplifier.load(tmp_path / "box.glb").faces) == again.levels[0].triangles


def test_results_are_told_in_a_line_each():
    """A notebook shows what an expression gives: it was a hundred thousand digits."""
    mesh = box()
    quick = {"preset": "draft", "resolution": 16, "views": 4, "image": 32}
    made = simplifier.simplify(mesh, **quick)
    measured, levels = made.measure(), simplifier.simplify(mesh, lods=2, **quick)
    judged = simplifier.evaluate(mesh, made.occluder, views=4, image=32)
    assert repr(mesh) == "<TriangleMesh: 12 triangles, 8 vertices>"
    assert repr(made).startswith("<SimplifyResult: <Occluder: 12 triangles, error bound ")
    assert repr(measured) == f"<MeasuredResult: good: {measured.verdict.reason}>"
    assert repr(judged) == f"<EvaluateResult: good: {judged.verdict.reason}>"
    assert repr(levels).startswith("<SimplifyResult: <LodChain: 1 level with 12 triangles>")
    assert repr(measured.overhang).startswith("<Overhang: mean ")
    assert all(len(repr(one)) < 200 for one in (mesh, made, measured, judged, levels))


@pytest.mark.parametrize("again", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_copies_are_read_only_too(again):
    mesh = box()
    for one in (mesh, simplifier.Occluder(mesh.vertices, mesh.faces)):
        copied = again(one)
        assert np.array_equal(copied.vertices, one.vertices)
        assert not copied.vertices.flags.writeable
        assert not copied.faces.flags.writeable


def test_how_to_hold_the_original_is_one_of_two(tmp_path):
    """What was not known was written as levels of detail."""
    made = simplifier.simplify(box(), preset="draft", resolution=8)
    simplifier.save(made, tmp_path / "a.glb")
    places = str(tmp_path / "a.glb"), str(tmp_path / "b.glb")
    for how in ("foo", "GODOT", None):
        with pytest.raises(OptionError, match=r"how: .* is not known; choose one of godot, lod"):
            made.save_with_original(*places, how)
    with pytest.raises(OptionError, match=r"sides and quads to simplifier\.save"):
        made.save(tmp_path / "c.glb", "single")
    assert [path.name for path in tmp_path.iterdir()] == ["a.glb"]
    assert made.save_with_original(*places, "godot") == (tmp_path / "b.glb",)
