"""``occluder cull --pvs`` of a walk through a generated town, through the real command line."""

from __future__ import annotations

import csv
import json
import struct

import numpy as np
import pytest

from bench.visibility_city import PITCH, generated_city
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import occluder_store, write_manifest
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import SceneOptions
from tests.acceptance.command import occluder
from tests.io.glazed import glazed
from tests.solids import box

SMALL = ("--image", "80x45")
OPTIONS = SceneOptions(budget=12, resolution=16, moves=50, up="z", pixel_error=2.0)
WAYS = ("frustum", "pvs", "occluders", "both")


def build(path):
    """The occluders of a scene, in a folder beside it."""
    scene = load_scene(path)
    folder = path.with_suffix("")
    made = build_occluders(scene, OPTIONS, occluder_store(folder), {})
    write_manifest(folder, scene, OPTIONS, made)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A folder with ``town.glb``, its occluders, a walk of 12 frames, and the sets."""
    folder = tmp_path_factory.mktemp("town")
    write_scene(generated_city(4), folder / "town.glb")
    build(folder / "town.glb")
    walk = [frame((2 * PITCH, y, 1.5), (0.1, 1, 0)) for y in np.linspace(10.0, 210.0, 12)]
    write_path(folder / "walk.json", walk)
    sets = ("pvs", folder / "town.glb", "-o", folder / "town.pvs", "--up", "z")
    assert occluder(*sets, "--cell-size", "30", "--epsilon", "10").returncode == 0
    return folder


def words(town, out, pvs="town.pvs", **changes):
    scene = changes.get("scene", town / "town.glb")
    return (
        "cull", scene, "--occluders", scene.with_suffix(""), "--path",
        changes.get("path", town / "walk.json"), "-o", out, "--pvs", town / pvs, *SMALL,
    )  # fmt: skip


def test_a_walk_through_the_streets(command, town, tmp_path):
    status, told, errors = command(*words(town, tmp_path))
    assert (status, errors) == (0, "")
    with (tmp_path / "cull.csv").open(newline="", encoding="ascii") as file:
        *frames, total = csv.DictReader(file, strict=True)
    assert len(frames) == 12
    for row in frames:
        for count in ("objects", "triangles"):
            frustum, pvs, occluded, both = (int(row[f"{way}_drawn_{count}"]) for way in WAYS)
            assert both <= min(pvs, occluded) <= max(pvs, occluded) <= frustum
        assert int(row["both_drawn_objects"]) >= (
            int(row["objects_in_view"]) - int(row["objects_hidden"]) - int(row["objects_wrong"])
        )
    assert total["pvs_wrong_pixels"] == total["pvs_wrong_objects"] == "0"
    assert total["outside_cells"] == "0"

    made = json.loads((tmp_path / "cull.json").read_text())
    assert made["pvs"]["frames_outside"] == 0
    drawn = made["drawn"]
    assert drawn["both"]["triangles"]["mean"] * 12 == int(total["both_drawn_triangles"])
    gained = [drawn[way]["share_of_frustum"] for way in WAYS]
    assert gained[0] == 1.0 > max(gained[1:3]) >= min(gained[1:3]) >= gained[3]
    assert gained[1] < 0.7  # a small town is hardly longer than its streets
    assert "0 of 12 frames, from which the sets have everything" in told
    for name in ("view frustum", "visible sets", "occluders", "both"):
        assert sum(name in line and line.count("│") > 5 for line in told.splitlines()) == 2


def test_without_sets_two_ways_are_told(command, town, tmp_path):
    given = words(town, tmp_path)
    place = given.index("--pvs")
    status, told, _ = command(*given[:place], *given[place + 2 :])
    assert status == 0
    assert "visible sets" not in told
    made = json.loads((tmp_path / "cull.json").read_text())
    assert (sorted(made["drawn"]), made["pvs"]) == (["frustum", "occluders"], None)


def test_from_above_all_cells_the_sets_have_everything(command, town, tmp_path):
    above = town / "roof.json"
    path = ("path", town / "town.glb", "-o", above, "--kind", "roof", "--up", "z", "--frames", "3")
    assert command(*path)[0] == 0
    assert command(*words(town, tmp_path, path=above))[0] == 0
    made = json.loads((tmp_path / "cull.json").read_text())
    assert made["pvs"]["frames_outside"] == 3
    assert made["drawn"]["pvs"] == made["drawn"]["frustum"]
    assert made["drawn"]["both"] == made["drawn"]["occluders"]


def refused(command, town, out, *said, **changes):
    status, told, errors = command(*words(town, out, **changes))
    assert (status, told, errors.count("\n")) == (1, "", 1)
    for words_ in said:
        assert words_ in errors
    assert not out.exists()


def test_sets_of_another_scene_are_refused(command, town, tmp_path):
    write_scene(generated_city(4, seed=7), tmp_path / "other.glb")
    arguments = ("pvs", tmp_path / "other.glb", "-o", town / "other.pvs", "--up", "z")
    assert command(*arguments, "--cell-size", "60")[0] == 0
    refused(
        command, town, tmp_path / "out", "visible sets of another scene",
        "find them again with 'occluder pvs'", pvs="other.pvs",
    )  # fmt: skip


def test_a_file_cut_short_or_missing_is_refused(command, town, tmp_path):
    data, bad = (town / "town.pvs").read_bytes(), town / "bad.pvs"
    for length in (0, 1, 7, 143, 144, len(data) // 2, len(data) - 1):
        bad.write_bytes(data[:length])
        remedy = (
            "copy or write it again" if length else "the file is empty; copy or export it again"
        )
        refused(command, town, tmp_path / "out", str(bad), remedy, pvs="bad.pvs")
    refused(command, town, tmp_path / "out", "none.pvs: there is no such file", pvs="none.pvs")


def test_a_flipped_bit_of_any_word_of_the_header_is_refused(command, town, tmp_path):
    data, bad = (town / "town.pvs").read_bytes(), town / "bad.pvs"
    for word in range(36):
        flipped = bytearray(data)
        (value,) = struct.unpack_from("<I", data, 4 * word)
        struct.pack_into("<I", flipped, 4 * word, value ^ 1 << (11 * word) % 32)
        bad.write_bytes(flipped)
        refused(command, town, tmp_path / "out", str(bad), pvs="bad.pvs")


@pytest.mark.parametrize("transparent", ["leave-out", "keep"])
def test_sets_with_glass_serve_the_scene_that_is_culled(command, tmp_path, transparent):
    """A shed behind a pane: in the sets, while the pane is no part of what is culled."""
    pane = box((10.0, 300.0, 30.0), (15.0, -150.0, 0.0))
    shed = box((5.0, 5.0, 3.0), (60.0, -2.0, 0.0))
    path, given = tmp_path / "glass.glb", ("--transparent", transparent)
    path.write_bytes(glazed({"pane": (None, pane), "shed": (shed, None)}))
    for name, text in (("cells", {"cells": [{"low": [-5, -5, 0], "high": [5, 5, 2]}]}),):
        (tmp_path / f"{name}.json").write_text(json.dumps(text))
    folder = tmp_path / "glass"
    options = ("--up", "z", "--budget", "12", "--resolution", "16", "--moves", "20")
    assert command("scene", path, "-o", folder, *options, *given)[0] == 0
    cells = tmp_path / "cells.json"
    assert command(
        "pvs", path, "-o", tmp_path / "glass.pvs", "--up", "z", "--cells", cells, "--epsilon",
        "2.5", *given,
    )[0] == 0  # fmt: skip
    walk, out = tmp_path / "walk.json", tmp_path / "out"
    write_path(walk, [frame((0, 0, 1.5), (1, 0, 0))])
    assert command(*words(tmp_path, out, "glass.pvs", scene=path, path=walk), *given)[0] == 0
    made = json.loads((out / "cull.json").read_text())
    assert made["scene"]["objects"] == (1 if transparent == "leave-out" else 2)
    assert made["drawn"]["pvs"]["objects"]["most"] == 1
    assert made["drawn"]["pvs"]["wrong_pixels"] == 0


def frame(position, forward):
    return {
        "position": position, "up": (0, 0, 1), "forward": forward, "fov": 60, "near": 0.1,
    }  # fmt: skip


def write_path(path, frames):
    path.write_text(json.dumps({"schema_version": 1, "name": path.stem, "frames": frames}))
