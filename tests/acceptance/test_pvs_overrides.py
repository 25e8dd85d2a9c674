"""Regions that overrides leave open, in ``occluder pvs``, ``pvs-check`` and ``cull --pvs``."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import simplifier
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import occluder_store, write_manifest
from simplifier.io.scene import load_scene
from simplifier.options.scene import SceneOptions
from tests.io.glazed import glazed
from tests.solids import box

OPEN = "[[open]]\nname = 'gate'\ncenter = [20.0, 0.0, 2.0]\nsize = [12.0, 4.0, 4.0]\n"
OPTIONS = SceneOptions(budget=12, resolution=16, moves=50, up="z", pixel_error=2.0)


@pytest.fixture
def town(tmp_path):
    """A long wall, a house behind it, and one cell before it."""
    wall = box((10.0, 300.0, 30.0), (15.0, -150.0, 0.0))
    house = box((10.0, 40.0, 12.0), (30.0, -20.0, 0.0))
    path = tmp_path / "town.glb"
    path.write_bytes(glazed({"wall": (wall, None), "house": (house, None)}))
    cells = {"cells": [{"low": [-5, -5, 0], "high": [5, 5, 2]}]}
    (tmp_path / "cells.json").write_text(json.dumps(cells))
    return path


def find(command, town, file):
    cells = town.with_name("cells.json")
    return command("pvs", town, "-o", file, "--up", "z", "--cells", cells, "--epsilon", "2.5")


def seen(file):
    held = simplifier.load_pvs(file)
    return {name for name, visible in zip(held.names, held.visible(0), strict=True) if visible}


def test_what_would_close_a_gate_hides_nothing(command, town, tmp_path):
    closed, left_open = tmp_path / "closed.pvs", tmp_path / "open.pvs"
    assert find(command, town, closed)[::2] == (0, "")
    assert seen(closed) == {"wall"}

    town.with_name("town.overrides.toml").write_text(OPEN)
    status, _, errors = find(command, town, left_open)
    assert status == 0
    assert "overrides leave regions open: 1 object that would close them may be seen" in errors
    assert "a scene takes none" not in errors
    assert seen(left_open) == {"wall", "house"}

    checked = command("pvs-check", town, left_open, "--views", "20", "--pictures", "2")
    assert (checked[0], "proven visible" in checked[1]) == (0, True)
    status, _, errors = command("pvs-check", town, closed)
    assert status == 1
    assert "find them again with 'occluder pvs'" in errors


def test_a_walk_is_judged_by_the_same_sets(command, town, tmp_path):
    town.with_name("town.overrides.toml").write_text(OPEN)
    find(command, town, tmp_path / "town.pvs")
    scene = load_scene(town)
    made = build_occluders(scene, OPTIONS, occluder_store(tmp_path / "town"), {})
    write_manifest(tmp_path / "town", scene, OPTIONS, made)
    frame = {
        "position": [0, 0, 1.5], "forward": [1, 0, 0], "up": [0, 0, 1], "fov": 60, "near": 0.1,
    }  # fmt: skip
    path = {"schema_version": 1, "name": "walk", "frames": [frame]}
    (tmp_path / "walk.json").write_text(json.dumps(path))
    status, told, errors = command(
        "cull", town, "--occluders", tmp_path / "town", "--path", tmp_path / "walk.json",
        "-o", tmp_path / "out", "--pvs", tmp_path / "town.pvs", "--image", "80x45",
    )  # fmt: skip
    assert status == 0, errors
    # Both objects by the sets; the wall alone by occluders, which overrides leave as they are.
    assert re.search(r"visible sets\W+0\W+2\W", told)
    assert re.search(r"occluders\W+0\W+1\W", told)


@pytest.mark.parametrize("text", ["[[open]]\nsize = 3\n", "[ignore]\nmeshes = ['wall']\n"])
def test_other_overrides_are_refused_or_told(command, town, tmp_path, text):
    """What cannot be read is no open region; names to ignore are for single meshes."""
    town.with_name("town.overrides.toml").write_text(text)
    status, _, errors = find(command, town, tmp_path / "town.pvs")
    if "open" in text:
        assert status == 1
        assert "town.overrides.toml" in errors
    else:
        assert status == 0
        assert "town.overrides.toml: overrides are for single meshes" in errors
        assert seen(tmp_path / "town.pvs") == {"wall"}


def test_only_what_reaches_into_a_region_is_opened(town):
    from simplifier.io.scene_layers import hiding_of, load_layers

    town.with_name("town.overrides.toml").write_text(
        OPEN.replace("20.0, 0.0, 2.0", "35.0, 0.0, 2.0")
    )
    whole, hiding = load_layers(town)
    assert (whole.names, hiding.names) == (("wall", "house"), ("wall",))
    assert hiding_of(town, load_scene(town)).names == ("wall",)
    np.testing.assert_array_equal(hiding.bounds(), whole.bounds()[:1])
    flush = OPEN.replace("20.0, 0.0, 2.0", "47.0, 0.0, 2.0").replace("12.0, 4.0", "14.0, 4.0")
    town.with_name("town.overrides.toml").write_text(flush)  # it begins where the house ends
    assert load_layers(town)[1].names == ("wall", "house")
