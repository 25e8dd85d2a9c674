"""``occluder pvs --method slice-wise`` for rooms, from the file to the check by pictures."""

from __future__ import annotations

import json

import pytest

import simplifier
from simplifier.io.scene_writer import write_scene
from tests.solids import box
from tests.visibility.rooms import bent_hall, scene_of, two_rooms
from tests.visibility.sheets import quad
from tests.visibility.sheets import scene_of as scene_of_sheets


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
        "pvs-check", rooms, file, "--cells", "4", "--views", "4", "--pictures", "2"
    )
    assert status == 0, told


@pytest.mark.parametrize("base", [0.0, 1.0])
def test_a_hall_that_is_one_closed_sheet_is_not_solid(command, tmp_path, base):
    """On the ground and above it: what is in the hall was missing from all sets."""
    path, file = tmp_path / "hall.glb", tmp_path / "hall.pvs"
    write_scene(bent_hall(base), path)
    status, told, errors = command("pvs", path, "-o", file, *ARGUMENTS, "--cells", "floors")
    assert status == 0
    assert "viewers are in 1 of the closed surfaces" in " ".join((told + errors).split())
    status, told, _ = command(
        "pvs-check", path, file, "--cells", "6", "--views", "8", "--pictures", "2"
    )
    assert status == 0, told
    assert "inf" not in told  # viewers in the hall were looked from
    held = simplifier.load_pvs(file)
    for point, seen in (((9.0, 1.0, base + 1.5), {"hall", "lamp"}),
                        ((1.5, 8.1, base + 1.5), {"hall", "chest"})):  # fmt: skip
        names = {name for name, one in zip(held.names, held.visible(point), strict=True) if one}
        assert seen <= names
        assert not {"lamp", "chest"} - seen & names


def test_a_slanted_open_sheet_hides_what_is_behind_it(command, tmp_path):
    """It is in no slice, being neither closed nor flat across an axis: it hid nothing."""
    path, file, cells = tmp_path / "wall.glb", tmp_path / "wall.pvs", tmp_path / "cells.json"
    wall = quad((5.0, -10.0, -6.0), (9.0, 10.0, -6.0), (11.0, 10.0, 8.0), (7.0, -10.0, 8.0))
    lamp, post = box((0.4, 0.4, 0.4), (14.0, 0.0, 1.5)), box((1.0, 1.0, 4.0), (20.0, 30.0, 0.0))
    write_scene(scene_of_sheets({"wall": wall, "lamp": lamp, "post": post}), path)
    cells.write_text(json.dumps({"cells": [{"low": [0, -0.5, 1], "high": [1, 0.5, 2]}]}))
    assert command("pvs", path, "-o", file, *ARGUMENTS, "--cells", cells)[0] == 0
    held = simplifier.load_pvs(file)
    seen = {name for name, one in zip(held.names, held.visible(0), strict=True) if one}
    assert seen == {"wall", "post"}
    assert command("pvs-check", path, file, "--views", "24", "--pictures", "24")[0] == 0


def test_what_it_has_not(command, rooms, tmp_path):
    for words, where in (
        (("--fill", "viewers"), "slices have no --fill"),
        (("--pictures", tmp_path / "drawn"), "sets by slices are not drawn"),
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


def test_a_seed_gives_the_same_bytes_each_time(command, rooms, tmp_path):
    files = [tmp_path / f"{name}.pvs" for name in ("first", "again", "other")]
    for file, seed in zip(files, ("5", "5", "6"), strict=True):
        status, told, errors = command(
            "pvs", rooms, "-o", file, *ARGUMENTS, "--cells", "floors", "--seed", seed
        )
        assert status == 0, told + errors
    first, again, other = (file.read_bytes() for file in files)
    assert first == again
    assert first != other  # by what it says of its making, at least
    held = [simplifier.load_pvs(file) for file in files]
    assert all((held[0].visible(cell) == held[2].visible(cell)).all() for cell in range(8))
