"""What Godot itself makes of the scripts that hide by visible sets."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

import simplifier
from tests.acceptance.command import ROOT, occluder
from tests.integrations.godot.test_engine import GODOT, Project

HERE = ROOT / "tests" / "integrations" / "godot"
SCRIPTS = [ROOT / "integrations" / "godot" / f"pvs_{name}.gd" for name in ("file", "culling")]
BOXES = {"wall": ((20, 5, 0), (20, 10, 300)), "shed": ((62, 1, 0), (5, 2, 5)),
         "house": ((-30, 5, 0), (10, 10, 10))}  # fmt: skip
CELLS = [[[-5, 0, -5], [5, 2, 5]], [[50, 0, -20], [55, 2, -10]]]
POINTS = [(0, 1.5, 0), (52, 1.5, -15), (0, 50, 0)]

pytestmark = pytest.mark.skipif(
    not GODOT, reason="Godot 4 is neither on PATH nor named by the variable GODOT"
)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A town, y up, with its sets: a wall between two cells, and a building on either side."""
    made = Project(tmp_path_factory.mktemp("godot"), "occluder")
    for script in (*SCRIPTS, HERE / "walk.gd"):
        (made.folder / script.name).write_bytes(script.read_bytes())
    town = trimesh.Scene()
    for name, (middle, size) in BOXES.items():
        place = trimesh.transformations.translation_matrix(middle)
        mesh = trimesh.creation.box(np.array(size), place)
        town.add_geometry(mesh, node_name=name, geom_name=name)
    made.imported("town.glb", town)
    cells = made.folder / "cells.json"
    cells.write_text(json.dumps({"cells": [{"low": low, "high": high} for low, high in CELLS]}))
    done = occluder(
        "pvs", made.folder / "town.glb", "-o", made.folder / "town.pvs", "--cells", cells
    )
    assert done.returncode == 0, done.stderr
    made.imports()
    return made


def walked(project, file):
    """What is visible from each of the points, and all that Godot says."""
    points = [",".join(map(str, point)) for point in POINTS]
    said = project._run(
        "--script", "res://walk.gd", "--", "res://town.glb", f"res://{file}", *points
    )
    (line,) = [line for line in said.splitlines() if line.startswith("{")]
    return json.loads(line), said


def test_nodes_are_visible_as_the_library_says(project):
    found, said = walked(project, "town.pvs")
    held = simplifier.load_pvs(project.folder / "town.pvs")
    for point, seen in zip(POINTS, found["seen"], strict=True):
        expected = [name for name, one in zip(held.names, held.visible(point), strict=True) if one]
        assert sorted(seen) == sorted(expected)
    assert len(found["seen"][0]) < len(found["seen"][2]) == len(BOXES)
    assert found["processing"] is True
    assert "ERROR" not in said


def test_a_broken_file_hides_nothing_and_is_an_error(project):
    data = bytearray((project.folder / "town.pvs").read_bytes())
    data[-1] ^= 1
    (project.folder / "bad.pvs").write_bytes(data)
    found, said = walked(project, "bad.pvs")
    assert [len(seen) for seen in found["seen"]] == [len(BOXES)] * len(POINTS)
    assert found["processing"] is False
    assert "bad.pvs: it is damaged: its checksum is another; nothing is hidden" in said
