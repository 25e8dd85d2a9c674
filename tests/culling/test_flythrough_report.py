"""cull.json, the words of the terminal, and the files in order."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from simplifier.culling.flythrough import fly
from simplifier.culling.flythrough_report import flythrough_files, summary
from simplifier.culling.flythrough_rows import drawn_tables, summary_rows
from simplifier.culling.visible_sets import VisibleSets
from simplifier.geometry.camera import CameraPath
from simplifier.wording import percent, small_percent
from tests.culling.occluded import (
    SMALL,
    WALL,
    exact,
    looking,
    path_of,
    sets_of,
    street,
    tree_of,
    wall_with_window,
)

SCHEMA = json.loads((Path(__file__).parents[2] / "docs" / "cull.schema.json").read_text())


def flown(*cameras, wall=WALL, sets=None):
    scene = street(wall)
    held = None if sets is None else VisibleSets.of(sets_of(scene, sets), scene, scene)
    return fly(scene, tree_of(scene, {"wall": exact(WALL)}), path_of(*cameras), SMALL, sets=held)


def required_everywhere(schema):
    """The schema with no key beyond the named ones, to see that it names all."""
    if isinstance(schema, list):
        return [required_everywhere(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    closed = {key: required_everywhere(value) for key, value in schema.items()}
    return {**closed, "additionalProperties": False} if "properties" in schema else closed


def test_it_is_as_the_schema_says():
    for found in (
        flown(), flown(wall=wall_with_window()), flown(looking(forward=(0, -1, 0))),
        flown(sets=["wall"]), flown(looking(forward=(1, 0, 0)), sets=[]),
    ):  # fmt: skip
        Draft202012Validator(required_everywhere(SCHEMA)).validate(summary(found, "a scene"))


def test_its_figures():
    found = flown(wall=wall_with_window())
    made, total = summary(found, "town.glb"), found.total
    assert made["scene"] == {
        "name": "town.glb", "objects": 7, "parts": 7, "triangles": 12 * 10,
    }  # fmt: skip
    assert made["path"] == {"name": "by hand", "frames": 1}
    assert made["parts"]["wrong"] == total.parts.wrong > 0
    assert made["pixels"]["wrong"] == total.wrong_pixels
    assert made["worst"]["wrong_pixels"]["frame"] == 0
    assert made["options"]["pixel_error"] == 0.5  # of the build
    assert made["occluders"]["triangles_max"] == 12
    assert json.loads(dict(flythrough_files(found, "town.glb"))["cull.json"]) == made


def test_what_is_drawn():
    aside = looking(forward=(1.0, 0.0, 0.0))
    found = flown(aside, looking(), looking((30.0, -10.0, 3.0)), sets=["wall", "beside"])
    made = summary(found, "town.glb")
    assert made["pvs"] == {
        "cells": 2, "computed": 1, "method": "cull-map", "conservative": True, "frames_outside": 1,
    }  # fmt: skip
    assert made["drawn"]["frustum"]["objects"]["most"] == 6
    assert made["drawn"]["both"]["triangles"]["frame"] == 1
    assert made["drawn"]["pvs"]["share_of_frustum"] < made["drawn"]["frustum"]["share_of_frustum"]
    objects, triangles = drawn_tables(found)
    for _, columns, rows in (objects, triangles):
        assert [row[0] for row in rows] == ["view frustum", "visible sets", "occluders", "both"]
        assert all(len(row) == len(columns) for row in rows)
    assert objects[2][1] == ("visible sets", "0", "1", "0", "2", "1")
    share = made["drawn"]["pvs"]["share_of_frustum"]
    assert triangles[2][1] == ("visible sets", percent(share), "0", "8", "0", "24", "1")
    assert dict(summary_rows(found))["outside of all cells"].startswith("1 of 3 frames, from which")
    assert len(dict(flythrough_files(found, "a"))["cull.csv"].splitlines()) == 5
    alone = flown()
    assert summary(alone, "")["pvs"] is None
    assert [row[0] for row in drawn_tables(alone)[0][2]] == ["view frustum", "occluders"]


def test_without_anything_hidden_there_is_no_recall():
    made = summary(flown(looking(forward=(0.0, -1.0, 0.0))), "town.glb")
    assert made["worst"]["recall"] is made["parts"]["recall"] is made["objects"]["recall"] is None


def test_the_table_comes_first():
    names = [name for name, _ in flythrough_files(flown(), "town.glb")]
    assert names == ["cull.csv", "cull.json", "walk.html", "cull.png", "frames.png"]


def test_rows_of_the_terminal():
    shown = dict(summary_rows(flown()))
    assert shown["frames"] == "1 of path 'by hand', 80 x 45 pixels, pixel error 0.5"
    assert shown["parts"] == shown["objects"] == "100.0 % of 4 hidden culled"
    assert shown["fewest parts"] == "100.0 % culled, in frame 0"
    assert shown["most wrong"] == "none wrong"
    assert shown["wrong pixels"].startswith("0 of ")
    assert shown["wrongly culled"] == "0 parts of 2 visible"
    assert "LOST" not in shown
    wrong = dict(summary_rows(flown(wall=wall_with_window())))
    assert wrong["most wrong"].endswith(" % of pixels, in frame 0")
    empty = dict(summary_rows(flown(looking(forward=(1.0, 0.0, 0.0)))))
    assert empty["parts"] == empty["fewest parts"] == "none hidden"


def test_an_interrupted_run_says_so():
    found = flown()
    longer = replace(found, path=CameraPath("long", found.path.cameras * 3))
    assert not longer.complete
    assert dict(summary_rows(longer))["frames"].startswith("1 of 3 of path 'long'")
    assert summary(longer, "")["frames_measured"] == 1


@pytest.mark.parametrize(
    ("value", "words"),
    [(0.0, "0 %"), (1.0, "100 %"), (0.995, "100 %"), (0.153, "15 %"), (0.0153, "1.5 %"),
     (9.31e-7, "0.000093 %"), (1.5, "150 %")],
)  # fmt: skip
def test_small_shares_keep_two_digits(value, words):
    assert small_percent(value) == words
