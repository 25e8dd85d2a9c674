"""``occluder pvs`` and ``pvs-check`` of a scene with glass, through the real command line."""

from __future__ import annotations

import json

import pytest

import simplifier
from tests.io.glazed import glazed
from tests.solids import box

EYE = "0,0,1.5"
HOUSE = box((10.0, 40.0, 12.0), (30.0, -20.0, 0.0))


@pytest.fixture
def town(tmp_path):
    """A glass wall before a house, and a shed behind that; one cell before the wall."""
    wall = box((10.0, 300.0, 30.0), (15.0, -150.0, 0.0))
    shed = box((5.0, 5.0, 3.0), (60.0, -2.0, 0.0))
    nodes = {"wall": (None, wall), "house": (HOUSE, None), "shed": (shed, None)}
    path = tmp_path / "town.glb"
    path.write_bytes(glazed(nodes))
    cells = {"cells": [{"low": [-5, -5, 0], "high": [5, 5, 2]}]}
    (tmp_path / "cells.json").write_text(json.dumps(cells))
    return path


def find(command, town, file, *more):
    cells = town.with_name("cells.json")
    return command(
        "pvs", town, "-o", file, "--up", "z", "--cells", cells, "--epsilon", "2.5", *more
    )


def seen(file):
    held = simplifier.load_pvs(file)
    return {name for name, visible in zip(held.names, held.visible(0), strict=True) if visible}


def test_a_glass_wall_before_a_house_hides_nothing(command, town, tmp_path):
    file, kept = tmp_path / "town.pvs", tmp_path / "kept.pvs"
    status, _, errors = find(command, town, file)
    assert status == 0
    assert "what one can see through may be seen, and hides nothing: all of 1 object" in errors
    assert seen(file) == {"wall", "house"}
    assert find(command, town, kept, "--transparent", "keep")[::2] == (0, "")
    assert seen(kept) == {"wall"}

    for pictures in ("0", "2"):
        arguments = ("pvs-check", town, file, "--views", "20", "--pictures", pictures)
        status, told, _ = command(*arguments)
        assert (status, "proven visible" in told) == (0, True)
    assert command("pvs-check", town, kept, "--transparent", "keep")[0] == 0


def test_sets_by_the_other_choice_are_of_another_scene(command, town, tmp_path):
    file = tmp_path / "town.pvs"
    _, told, _ = find(command, town, file, "--transparent", "keep")
    assert f"next: occluder pvs-check {town} {file} --transparent keep\n" in told
    status, _, errors = command("pvs-check", town, file)
    assert status == 1
    assert "or by another --transparent; find them again with 'occluder pvs'" in errors
    status, told, _ = find(command, town, file)
    assert "1 of 1, 0 kept from before" in told
    assert seen(file) == {"wall", "house"}
