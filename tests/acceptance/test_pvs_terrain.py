"""``occluder pvs`` and ``pvs-check`` of elevation models: a ridge, refusals, options."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pytest

import simplifier
from simplifier.cli import pvs

SPACING = ("--spacing", "10,10")


def ridge(tmp_path, holes=(), rows=33):
    """A ridge from north to south between two valleys, as an array."""
    heights = np.zeros((rows, 65), np.int16)
    heights[:, 28:31] = 50
    values = heights.astype(np.float32) if len(holes) else heights
    for row, column in holes:
        values[row, column] = np.nan
    path = tmp_path / "ridge.npy"
    np.save(path, values)
    return path


def test_a_ridge_hides_the_valley_behind_it(command, tmp_path):
    dem, file, report = ridge(tmp_path, rows=17), tmp_path / "ridge.pvs", tmp_path / "report.json"
    arguments = (
        *SPACING,
        "--tile",
        "8",
        "--cell-size",
        "40",
        "--epsilon",
        "10",
        "--report",
        report,
    )
    status, told, errors = command("pvs", dem, "-o", file, *arguments)
    assert (status, errors) == (0, "")
    assert "cull-map, since a terrain has one height at each place" in " ".join(told.split())
    figures = json.loads(report.read_text())
    assert figures["objects"] == 16
    held = simplifier.load_pvs(file)
    assert held.up == "z"
    assert "tile_1_7" in held.names
    east = np.array([int(name.split("_")[2]) >= 4 for name in held.names])
    assert not held.visible((100.0, 80.0, 1.0))[east].any()
    assert held.visible((100.0, 80.0, 1.0))[~east].mean() > 0.9
    assert not held.visible((600.0, 80.0, 1.0))[~east].all()

    # The command that it names is one that can be run.
    (then,) = (line for line in told.splitlines() if line.startswith("next: "))
    words = shlex.split(then)[2:]
    assert words[:3] == ["pvs-check", str(dem), str(file)]
    looks = ("--cells", "6", "--views", "12", "--pictures", "1")
    status, told, _ = command(*words, *looks)
    assert status == 0
    assert "leaks" in told

    before = file.read_bytes()
    assert "kept from before" in command("pvs", dem, "-o", file, *arguments)[1]
    assert file.read_bytes() == before
    status, _, errors = command("pvs-check", dem, file, *SPACING, "--tile", "4")
    assert status == 1
    assert "another scene" in errors


def test_holes_are_told_and_always_visible(command, tmp_path):
    dem, file = ridge(tmp_path, [(5, 60), (6, 60)], 17), tmp_path / "ridge.pvs"
    arguments = (*SPACING, "--tile", "8", "--cell-size", "40", "--epsilon", "10", "--cells", "grid")
    status, told, errors = command("pvs", dem, "-o", file, *arguments)
    assert status == 0
    words = " ".join((told + errors).split())
    assert "2 of 1,105 posts have no height" in words
    assert "1 tile with such posts always visible" in words
    held = simplifier.load_pvs(file)
    seen = held.visible((100.0, 80.0, 1.0))
    assert seen[held.names.index("tile_0_7")]
    assert not seen[held.names.index("tile_1_7")]


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ((), 2, "give the spacing, DX,DY in world units"),
        (("--spacing", "1"), 2, "spacing: 1 lengths are given; give 2"),
        (("--spacing", "1,x"), 2, "spacing"),
        (("--spacing", "0,1"), 2, "spacing"),
        ((*SPACING, "--tile", "0"), 2, "tile"),
        ((*SPACING, "--memory-limit", "0.1"), 1, "GiB"),
        ((*SPACING, "--epsilon", "0.001"), 2, "or more"),
    ],
)
def test_what_is_refused_leaves_nothing_behind(command, tmp_path, arguments, status, words):
    dem, file = ridge(tmp_path), tmp_path / "ridge.pvs"
    found, _, errors = command("pvs", dem, "-o", file, *arguments)
    assert found == status
    assert words in errors
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ridge.npy"]


@pytest.mark.parametrize("name", ["posts.npy", "posts.tif"])
@pytest.mark.parametrize(
    "data", [b"", b"\x93NUMPY\x01\x00", b"II*\x00\xff\xff\xff\xff", bytes(99)],
    ids=["empty", "header", "offset", "zeros"],
)  # fmt: skip
def test_damaged_files_are_refused_by_name(command, tmp_path, name, data):
    path, file = tmp_path / name, tmp_path / "out.pvs"
    path.write_bytes(data)
    status, _, errors = command("pvs", path, "-o", file, *SPACING)
    assert status == 1
    assert name in errors
    assert "Traceback" not in errors
    assert not file.exists()


def test_meshes_have_no_spacing(command, tmp_path):
    mesh = tmp_path / "one.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 2 4\n")
    status, _, errors = command("pvs", mesh, "-o", tmp_path / "one.pvs", *SPACING)
    assert status == 2
    assert "a scene of meshes has none" in errors


def test_hours_are_foretold_with_what_makes_them_fewer(command, tmp_path, monkeypatch):
    """Of a terrain in cells of ten metres it was told in seconds, as a power of ten."""
    dem, file = ridge(tmp_path, rows=17), tmp_path / "ridge.pvs"
    run = ("pvs", dem, "-o", file, *SPACING, "--cell-size", "40")
    assert command(*run)[2] == ""
    monkeypatch.setattr(pvs, "_LONG", 0.0)
    file.unlink()
    status, _, errors = command(*run)
    assert status == 0
    assert "larger cells (--cell-size) are fewer" in errors
