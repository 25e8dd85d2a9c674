"""``occluder pvs --method slice-wise`` for rooms, from the file to the check by pictures."""

from __future__ import annotations

import json

import pytest

import simplifier
from simplifier.io.scene_writer import write_scene
from tests.visibility.rooms import scene_of, two_rooms


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    path = tmp_path_factory.mktemp("rooms") / "rooms.glb"
    write_scene(scene_of(two_rooms()), path)
    return path


ARGUMENTS = ("--up", "z", "--method", "slice-wise", "--cell-size", "1", "--epsilon", "0.5")


def test_two_rooms_with_a_door(command, rooms, tmp_path):
    file, report = tmp_path / "rooms.pvs", tmp_path / "report.json"
    status, told, _ = command(
        "pvs", rooms, "-o", file, *ARGUMENTS, "--cells", "floors", "--report", report
    )
    assert status == 0
    assert "slice-wise" in told
    assert json.loads(report.read_text())["cells"] >= 24
    held = simplifier.load_pvs(file)
    assert not held.conservative
    in_west = {
        name for name, seen in zip(held.names, held.visible((1.5, 0.5, 1.5)), strict=True) if seen
    }
    before_door = {
        name for name, seen in zip(held.names, held.visible((3.5, 2.1, 1.5)), strict=True) if seen
    }
    assert "lamp" in before_door
    assert not {"chest", "tree"} & in_west
    assert "tree" not in before_door
    status, told, _ = command(
        "pvs-check", rooms, file, "--cells", "8", "--views", "4", "--pictures", "4"
    )
    assert status == 0, told


def test_what_it_has_not(command, rooms, tmp_path):
    for words, where in (
        (("--fill", "viewers"), "slices have no --fill"),
        (("--pictures", tmp_path / "drawn"), "only cull maps and voxel columns are drawn"),
        (("--epsilon", "0.001"), "voxels"),
    ):
        status, _, errors = command(
            "pvs", rooms, "-o", tmp_path / "no.pvs", *ARGUMENTS, "--cells", "floors", *words
        )
        assert status in (1, 2)
        assert where in errors


def test_where_there_are_no_rooms(command, tmp_path):
    path = tmp_path / "yard.glb"
    write_scene(scene_of({"slab": ((0.0, 0.0, 0.0), (9.0, 9.0, 0.2))}), path)
    status, _, errors = command(
        "pvs", path, "-o", tmp_path / "no.pvs", *ARGUMENTS, "--cells", "floors"
    )
    assert status in (1, 2)
    assert "no floor in a room" in errors
