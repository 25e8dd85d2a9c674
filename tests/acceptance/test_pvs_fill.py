"""``occluder pvs --fill viewers``: what it culls of open sheets, and the holes that it tells of."""

from __future__ import annotations

import json

import pytest

import simplifier
from simplifier.io.scene_writer import write_scene
from tests.visibility.sheets import house, house_with_hole, post, quad, scene_of


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    """Files by name: houses of sheets, and the cells around them."""
    folder = tmp_path_factory.mktemp("sheets")
    closed = house("house", (20.0, -20.0, 0.0), (36.0, 20.0, 9.0)) | post()
    holed = house_with_hole(hole=(-3.0, -1.5, 3.0, 6.0))
    # A roof that lies on its walls without sharing their corners is not closed to the last digit.
    holed |= house("next", (20, 15, 0), (36, 35, 9), ("floor", "roof"))
    holed["next roof"] = quad((20, 15, 9.001), (36, 15, 9.001), (36, 35, 9.001), (20, 35, 9.001))
    places = ((-5, -5), (80, -5), (20, 40), (20, -50))
    cells = {"cells": [{"low": [x, y, 0], "high": [x + 10, y + 10, 2]} for x, y in places]}
    (folder / "cells.json").write_text(json.dumps(cells))
    for name, sheets in (("closed", closed), ("holed", holed | post())):
        write_scene(scene_of(sheets), folder / f"{name}.glb")
    return folder


def found(command, street, scene, tmp_path, *more):
    file, report = tmp_path / "sets.pvs", tmp_path / "report.json"
    status, told, errors = command(
        "pvs", street / f"{scene}.glb", "-o", file, "--up", "z", "--epsilon", "2.5",
        "--cells", street / "cells.json", "--report", report, *more,
    )  # fmt: skip
    assert status == 0
    return file, json.loads(report.read_text()), told, errors


def test_closed_houses_of_sheets_are_solid_and_the_file_is_conservative(command, street, tmp_path):
    _, figures, _, _ = found(command, street, "closed", tmp_path, "--fill", "outside")
    assert figures["culled_share"] == 0.0
    (tmp_path / "sets.pvs").unlink()
    file, figures, told, _ = found(command, street, "closed", tmp_path, "--fill", "viewers")
    assert figures["culled_share"] > 0.1
    assert figures["conservative"]
    assert figures["holes"] == []
    assert "not conservative" not in told
    assert simplifier.load_pvs(file).conservative
    checked = command("pvs-check", street / "closed.glb", file, "--views", "20", "--pictures", "2")
    assert checked[0] == 0
    assert "cull-map, conservative" in command("pvs-show", file)[1]
    # Other settings, other sets: what outside finds is not kept.
    _, _, told, _ = found(command, street, "closed", tmp_path, "--fill", "outside")
    assert "4 of 4, 0 kept from before" in told


def test_a_hole_is_told_with_its_place_and_width(command, street, tmp_path):
    file, figures, told, errors = found(command, street, "holed", tmp_path, "--fill", "viewers")
    (leak,) = figures["holes"]
    assert leak["name"] == "holed west"
    assert leak["point"] == pytest.approx([20.0, -2.25, 4.5], abs=1.0)
    assert leak["width"] == pytest.approx(1.5, abs=0.25)
    text = " ".join((told + errors).split())
    assert "near 'holed west' hides nothing: there is a hole about 1." in text
    assert not figures["conservative"]
    assert "cull-map, not conservative" in told
    assert "closed pieces of the mesh do not prove what counts as solid" in text
    assert not simplifier.load_pvs(file).conservative
    assert "not conservative" in command("pvs-show", file)[1]
    assert command("pvs-check", street / "holed.glb", file, "--views", "20")[0] == 0


def test_another_word_is_refused(command, street, tmp_path):
    scene = street / "closed.glb"
    status, _, errors = command("pvs", scene, "-o", tmp_path / "a.pvs", "--fill", "sight")
    assert status == 2
    assert "viewers" in errors
