"""``occluder pvs``, ``pvs-show`` and ``pvs-check``: what they write, show and refuse."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import replace

import numpy as np
import pytest

import simplifier
from bench.visibility_city import generated_city, street_cells
from simplifier.geometry.pvs import pack_rows
from simplifier.geometry.view_cells import BOX, PRISM
from simplifier.io.pvs_file import save_pvs
from simplifier.io.scene_writer import write_scene
from simplifier.visibility.checking.check import check_pvs
from tests.io.damaged_pvs import town as made_town


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A small city, z up, as a file."""
    path = tmp_path_factory.mktemp("town") / "town.glb"
    write_scene(generated_city(3), path)
    return path


@pytest.fixture(scope="module")
def cells(town):
    """Street cells as a file beside it."""
    places = street_cells(generated_city(3), 12)
    path = town.with_suffix(".json")
    boxes = [
        {"low": low.tolist(), "high": high.tolist()}
        for low, high in zip(places.low, places.high, strict=True)
    ]
    path.write_text(json.dumps({"cells": boxes}))
    return path


@pytest.fixture(scope="module")
def three_cells(cells):
    """The first of them: in slices each takes most of a second."""
    path = cells.with_name("three.json")
    path.write_text(json.dumps({"cells": json.loads(cells.read_text())["cells"][:3]}))
    return path


def test_sets_are_found_shown_checked_and_read(command, town, cells, tmp_path):
    file, report = tmp_path / "town.pvs", tmp_path / "report.json"
    status, told, errors = command(
        "pvs", town, "-o", file, "--up", "z", "--cells", cells, "--epsilon", "2.5", "--report",
        report,
    )  # fmt: skip
    assert (status, errors) == (0, "")
    assert "12 of 12, 0 kept from before" in told
    figures = json.loads(report.read_text())
    assert figures["cells"] == figures["computed_now"] == 12
    assert 0.3 < figures["culled_share"] < 1.0
    assert figures["methods"] == ["strong", "cull-map"]
    assert figures["foretold"]["cells"] == 4
    assert 0.0 < figures["cost"]["seconds_a_cell"] < figures["cost"]["seconds"]
    assert "since 100 % of what stands in the scene is solid from the ground up" in " ".join(
        told.split()
    )
    assert "foretold by 4 of them" in " ".join(told.split())

    status, told, _ = command("pvs-show", file)
    assert status == 0
    assert "cull-map, conservative" in told
    low = json.loads(cells.read_text())["cells"][0]["low"]
    point = ",".join(str(value + 1.0) for value in low)
    status, told, _ = command("pvs-show", file, "--at", point)
    assert status == 0
    assert "is in cell 0: " in told
    assert "outside of all cells: " in command("pvs-show", file, "--at", "0,0,500")[1]
    assert command("pvs-show", file, "--quiet") == (0, "", "")

    status, told, _ = command("pvs-check", town, file, "--cells", "6", "--views", "20")
    assert status == 0
    held = simplifier.load_pvs(file)
    assert held.visible(np.array(low) + 1.0).sum() < len(held.names)
    assert held.visible((0.0, 0.0, 500.0)).all()

    before = file.read_bytes()
    status, told, _ = command(
        "pvs", town, "-o", file, "--up", "z", "--cells", cells, "--epsilon", "2.5"
    )
    assert "12 of 12, 12 kept from before" in told
    assert file.read_bytes() == before


def test_cells_are_placed_where_one_can_walk(command, town, tmp_path):
    counts = []
    for placing in ("walkable", "grid"):
        file = tmp_path / f"{placing}.pvs"
        arguments = ("--up", "z", "--cells", placing, "--cell-size", "30")
        assert command("pvs", town, "-o", file, *arguments)[0] == 0
        counts.append(len(simplifier.load_pvs(file).cells))
        assert command("pvs-check", town, file, "--cells", "5", "--views", "10")[0] == 0
    assert 0 < counts[0] <= counts[1]


def test_free_space_is_divided_into_triangles(command, town, tmp_path):
    file = tmp_path / "town.pvs"
    arguments = ("--up", "z", "--cells", "triangles", "--cell-size", "40")
    assert command("pvs", town, "-o", file, *arguments)[0] == 0
    held = simplifier.load_pvs(file)
    assert (held.cells.kinds == PRISM).all()
    place = held.cells.corners[7].mean(axis=0)
    point = np.array([*place, 1.0]) + held.origin
    status, told, _ = command("pvs-show", file, "--at", ",".join(map(str, point)))
    assert (status, "is in cell 7: " in told) == (0, True)
    status, told, _ = command("pvs-check", town, file, "--cells", "10", "--views", "20")
    assert status == 0
    before = file.read_bytes()
    _, told, _ = command("pvs", town, "-o", file, *arguments)
    assert f"{len(held.cells)} of {len(held.cells)}, {len(held.cells)} kept" in told
    assert file.read_bytes() == before


@pytest.mark.parametrize("up", ["y", "z"])
def test_a_file_has_prisms_and_boxes_in_any_order(command, tmp_path, up):
    town, cells, file = tmp_path / "town.glb", tmp_path / "cells.json", tmp_path / "town.pvs"
    city = generated_city(2)
    if up == "y":
        turn = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
        city = replace(city, transforms=turn @ city.transforms)
    write_scene(city, town)
    street = street_cells(generated_city(2), 2)
    (x, y), (x1, y1) = street.low[0, :2].tolist(), street.high[0, :2].tolist()
    prism = np.array([[x, y], [x1, y], [x, y1]])
    low, high = street.low[1].tolist(), street.high[1].tolist()
    if up == "y":
        prism[:, 1] *= -1.0
        low, high = [low[0], 0.0, -high[1]], [high[0], high[2], -low[1]]
    some = [
        {"corners": prism.tolist(), "low": 0.0, "high": 2.0},
        {"low": low, "high": high},
        {"corners": prism[::-1].tolist(), "low": 1.0, "high": 3.0},
    ]
    cells.write_text(json.dumps({"cells": some}))
    assert command("pvs", town, "-o", file, "--up", up, "--cells", cells)[0] == 0
    held = simplifier.load_pvs(file)
    assert held.cells.kinds.tolist() == [PRISM, BOX, PRISM]
    inner = prism.mean(axis=0).tolist()
    point = [inner[0], 1.5, inner[1]] if up == "y" else [*inner, 1.5]
    status, told, _ = command("pvs-show", file, "--at", ",".join(map(str, point)))
    assert "is in cell 0, 2: " in told
    assert command("pvs-check", town, file, "--views", "20", "--pictures", "1")[0] == 0
    some[1]["high"] = some[1]["low"]
    cells.write_text(json.dumps({"cells": some}))
    status, _, errors = command("pvs", town, "-o", file, "--up", up, "--cells", cells)
    assert status == 2
    assert "cell 1 holds nothing" in errors


def test_a_leak_is_told_and_ends_with_1(command, town, cells, tmp_path):
    file = tmp_path / "town.pvs"
    assert command("pvs", town, "-o", file, "--up", "z", "--cells", cells)[0] == 0
    held = simplifier.load_pvs(file)
    rows, places = pack_rows([np.zeros(len(held.names), bool)] * len(held.cells))
    save_pvs(replace(held, rows=rows, row_of=places), file)
    status, _, errors = command("pvs-check", town, file, "--cells", "2", "--views", "10")
    assert status == 1
    assert "leak: cell " in errors
    assert "seen by line from" in errors


def test_a_cell_within_a_building_is_refused_or_skipped(command, town, cells, tmp_path):
    file, some = tmp_path / "town.pvs", json.loads(cells.read_text())["cells"][:1]
    middle = generated_city(3).bounds()[5].mean(axis=0)
    some.append({"low": (middle - 0.2).tolist(), "high": (middle + 0.2).tolist()})
    (tmp_path / "some.json").write_text(json.dumps({"cells": some}))
    asked = ("pvs", town, "-o", file, "--up", "z", "--cells", tmp_path / "some.json")
    status, _, errors = command(*asked)
    assert status == 2
    assert "cell 1 lies wholly within " in errors
    assert "--skip-buried" in errors
    assert command(*asked, "--skip-buried")[0] == 0
    assert len(simplifier.load_pvs(file).cells) == 1


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("--cells", "nowhere"), 2, "neither a way to place cells nor a file"),
        (("--cell-size", "0"), 2, "cell size"),
        (("--epsilon", "1e-9"), 2, "or more"),
        (("--cell-size", "0.001"), 2, "or more"),
        (("--method", "magic"), 2, "method"),
    ],
)
def test_what_is_refused(command, town, tmp_path, arguments, status, words):
    file = tmp_path / "town.pvs"
    found, _, errors = command("pvs", town, "-o", file, "--up", "z", *arguments)
    assert found == status
    assert words in errors
    assert not file.exists()


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{}",
        '{"cells": []}',
        '{"cells": [{"low": [0, 0]}]}',
        "no",
        '{"cells": [{"corners": [[0, 0], [1, 0]], "low": 0, "high": 1}]}',
        '{"cells": [{"corners": [[0, 0], [1, 0], [2, 0]], "low": 0, "high": 1}]}',
    ],
)
def test_what_are_no_cells_is_refused(command, town, tmp_path, text):
    cells, file = tmp_path / "cells.json", tmp_path / "town.pvs"
    cells.write_text(text)
    status, _, errors = command("pvs", town, "-o", file, "--up", "z", "--cells", cells)
    assert status == 2
    assert "cells" in errors
    assert not file.exists()


def test_sets_of_another_scene_and_damaged_ones_are_refused(command, town, cells, tmp_path):
    file, other = tmp_path / "town.pvs", tmp_path / "other.glb"
    assert command("pvs", town, "-o", file, "--up", "z", "--cells", cells)[0] == 0
    write_scene(generated_city(3, seed=9), other)
    status, _, errors = command("pvs-check", other, file)
    assert status == 1
    assert "another scene" in errors
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)
    for arguments in (("pvs-check", town, file), ("pvs-show", file)):
        status, _, errors = command(*arguments)
        assert status == 1
        assert str(file) in errors
    assert command("pvs", town, "-o", file, "--up", "z", "--cells", cells)[0] == 1
    assert file.read_bytes() == bytes(data)
    assert command("pvs", town, "-o", town, "--up", "z")[0] != 0


def test_a_bad_point_is_refused(command, town, cells, tmp_path):
    file = tmp_path / "town.pvs"
    assert command("pvs", town, "-o", file, "--up", "z", "--cells", cells)[0] == 0
    for text in ("1,2", "a,b,c", "nan,0,0"):
        status, _, errors = command("pvs-show", file, "--at", text)
        assert status == 2
        assert "give X,Y,Z" in errors


def test_slices_and_altitudes_of_a_point_are_shown(command, tmp_path):
    file = tmp_path / "made.pvs"
    save_pvs(made_town(), file)
    status, told, _ = command("pvs-show", file)
    assert status == 0
    assert "60.0 % of what is visible is drawn in part" in told
    assert "steps of 0.25, from 100 up" in told
    status, told, _ = command("pvs-show", file, "--at", "2000000.5,101,5000000.5")
    assert "2 of 4 objects can be seen" in told
    assert "Häuser: slices z 1 to 3 of 8\n" in told
    assert "Häfen: slices x 3 to 8 and y 5 to 8 of 8; seen from 100.5 up\n" in told
    status, told, _ = command("pvs-show", file, "--at", "2000000.5,100.4,5000000.5")
    assert "1 of 4 objects can be seen" in told
    assert "Häfen" not in told


@pytest.mark.usefixtures("small_pictures")
def test_slices_are_found_shown_and_checked(command, town, three_cells, tmp_path):
    file = tmp_path / "town.pvs"
    arguments = ("pvs", town, "-o", file, "--up", "z", "--cells", three_cells, "--slices")
    status, told, errors = command(*arguments, "--pictures", tmp_path / "pictures")
    assert (status, errors) == (0, "")
    assert "is drawn in part" in told
    assert (tmp_path / "pictures" / "slices.png").read_bytes().startswith(b"\x89PNG")
    before = file.read_bytes()
    assert "3 of 3, 3 kept from before" in command(*arguments)[1]
    assert file.read_bytes() == before
    held = simplifier.load_pvs(file)
    assert (held.slices.values != 0).any(axis=1).mean() > 0.9
    low = json.loads(three_cells.read_text())["cells"][0]["low"]
    point = ",".join(str(value + 1.0) for value in low)
    assert ": slices " in command("pvs-show", file, "--at", point)[1]
    check = ("pvs-check", town, file, "--cells", "3", "--views", "30")
    assert command(*check)[0] == 0
    nothing = np.full_like(held.slices.values, [0, 0, 8])
    save_pvs(replace(held, slices=replace(held.slices, values=nothing)), file)
    status, _, errors = command(*check)
    assert status == 1
    assert " hides a part of 'block " in errors
    status, _, errors = command(*arguments, "--backend", "opengl")
    assert status == 2
    assert "leave --slices out" in errors


def test_strong_occluders_find_sets_of_their_own(command, town, cells, tmp_path):
    file, report = tmp_path / "town.pvs", tmp_path / "report.json"
    arguments = ("pvs", town, "-o", file, "--up", "z", "--cells", cells, "--method", "strong")
    status, _, errors = command(*arguments, "--report", report)
    assert (status, errors) == (0, "")
    figures = json.loads(report.read_text())
    assert (figures["method"], figures["conservative"]) == ("strong-occluders", True)
    assert figures["culled_share"] > 0.2
    assert "strong-occluders, conservative" in command("pvs-show", file)[1]
    assert command("pvs-check", town, file, "--cells", "12", "--views", "40")[0] == 0
    before = file.read_bytes()
    assert "12 of 12, 12 kept from before" in command(*arguments)[1]
    assert file.read_bytes() == before
    for extra in (
        ("--backend", "opengl"),
        ("--fill", "viewers"),
        ("--slices",),
    ):
        status, _, errors = command(*arguments, *extra)
        assert status == 2
        assert "choose --method cull-map" in errors
    assert file.read_bytes() == before


def test_a_check_that_was_interrupted_does_not_pass(command, town, tmp_path, monkeypatch):
    file = tmp_path / "sets.pvs"
    arguments = ("--up", "z", "--cells", "walkable", "--cell-size", "30")
    assert command("pvs", town, "-o", file, *arguments)[0] == 0
    cells = len(simplifier.load_pvs(file).cells)

    def check_and_press(scene, pvs, options, tell, *more):
        shares = []

        def told(share):
            tell(share)
            shares.append(share)
            if len(shares) == 2:  # the first cell is checked; a second signal ends the process
                os.kill(os.getpid(), signal.SIGINT)

        return check_pvs(scene, pvs, options, told, *more)

    monkeypatch.setattr("simplifier.visibility.checking.check.check_pvs", check_and_press)
    status, told, errors = command("pvs-check", town, file, "--cells", str(cells), "--views", "5")
    assert status == 130
    assert f"2 of {cells}" in told
    assert f"error: interrupted after 2 of {cells} cells" in errors
