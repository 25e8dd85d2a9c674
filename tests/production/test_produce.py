"""A run as one call: what the command writes, without the command."""

from __future__ import annotations

import threading

import pytest

import simplifier
from simplifier import CancelledError, SimplifyOptions
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
