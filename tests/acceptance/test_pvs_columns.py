"""``occluder pvs --method voxel-column``: elevation models, and what is none."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

import simplifier
from bench.visibility_city import generated_city
from simplifier.io.scene_writer import write_scene
from tests.acceptance.test_pvs_terrain import SPACING, ridge

COLUMNS = (*SPACING, "--tile", "8", "--method", "voxel-column", "--eye-height", "30")


def test_a_ridge_hides_more_from_lower_altitudes(command, tmp_path):
    dem, file, report = ridge(tmp_path), tmp_path / "ridge.pvs", tmp_path / "report.json"
    status, told, errors = command("pvs", dem, "-o", file, *COLUMNS, "--report", report)
    assert (status, errors) == (0, "")
    assert "voxel-column, as was asked for" in " ".join(told.split())
    figures = json.loads(report.read_text())
    assert (figures["objects"], figures["cells"], figures["conservative"]) == (32, 32, True)
    held = simplifier.load_pvs(file)
    east = np.array([int(name.split("_")[2]) >= 4 for name in held.names])
    assert not held.visible((100.0, 160.0, 1.0))[east].any()
    assert held.visible((100.0, 160.0, 1.0))[~east].mean() > 0.9
    assert held.visible((100.0, 160.0, 31.0)).all()

    looks = ("--cells", "6", "--views", "12")
    assert command("pvs-check", dem, file, *SPACING, "--tile", "8", *looks)[0] == 0
    before = file.read_bytes()
    status, told, _ = command("pvs", dem, "-o", file, *COLUMNS)
    assert "32 of 32, 32 kept from before" in " ".join(told.split())
    assert file.read_bytes() == before
    assert "voxel-column, conservative" in command("pvs-show", file)[1]


def test_cells_no_smaller_than_tiles_are_columns_by_auto(command, tmp_path):
    dem, file = ridge(tmp_path), tmp_path / "ridge.pvs"
    arguments = (*SPACING, "--tile", "8", "--cell-size", "90")
    status, told, _ = command("pvs", dem, "-o", file, *arguments)
    words = " ".join(told.split())
    assert status == 0
    assert "voxel-column, since it is a terrain, and cells are 80 wide, its tiles 80" in words
    assert simplifier.load_pvs(file).altitudes is not None
    assert "32 of 32, 32 kept from before" in " ".join(
        command("pvs", dem, "-o", file, *arguments)[1].split()
    )
    assert command("pvs-check", dem, file, *SPACING, "--tile", "8", "--cells", "6")[0] == 0


def test_the_horizons_of_a_column_are_drawn(command, tmp_path):
    dem, folder = ridge(tmp_path), tmp_path / "pictures"
    assert command("pvs", dem, "-o", tmp_path / "ridge.pvs", *COLUMNS, "--pictures", folder)[0] == 0
    assert sorted(one.name for one in folder.iterdir()) == ["cells.png", "horizons.png"]
    image = cv2.imread(str(folder / "horizons.png"))[..., ::-1].astype(int)
    plan = image[: int(0.8 * len(image))]
    cell = (np.abs(plan - (181, 0, 79)) <= 2).all(axis=2)
    assert cell.sum() > 1000
    # Bright is what is seen from the ground, on the column's side of the ridge.
    bright = plan.min(axis=2) > 200
    sides = [bright[:, half].mean() for half in np.array_split(np.arange(plan.shape[1]), 2)]
    column = np.argwhere(cell)[:, 1].mean() / plan.shape[1]
    assert sides[int(column > 0.5)] > sides[int(column < 0.5)]


def test_a_hole_is_told_and_its_tile_always_visible(command, tmp_path):
    dem, file = ridge(tmp_path, [(5, 60), (6, 60)]), tmp_path / "ridge.pvs"
    status, told, errors = command("pvs", dem, "-o", file, *COLUMNS)
    assert status == 0
    assert "1 tile with such posts always visible" in " ".join((told + errors).split())
    held = simplifier.load_pvs(file)
    seen = held.visible((100.0, 160.0, 1.0))
    assert seen[held.names.index("tile_0_7")]
    assert not seen[held.names.index("tile_2_7")]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--cells", "triangles"), "choose walkable or grid"),
        (("--fill", "viewers"), "voxel columns have no --fill"),
    ],
)
def test_what_columns_have_not_is_refused(command, tmp_path, arguments, words):
    dem, file = ridge(tmp_path), tmp_path / "ridge.pvs"
    status, _, errors = command("pvs", dem, "-o", file, *COLUMNS, *arguments)
    assert status == 2
    assert words in " ".join(errors.split())
    assert not file.exists()


def test_a_scene_of_meshes_is_told_what_it_would_lose_and_which_method_serves(command, tmp_path):
    town, file = tmp_path / "town.glb", tmp_path / "town.pvs"
    write_scene(generated_city(2), town)
    status, _, errors = command("pvs", town, "-o", file, "--up", "z", "--method", "voxel-column")
    words = " ".join(errors.split())
    assert status == 2
    assert "voxel columns need an elevation model" in words
    assert "choose cull-map for what stands on the ground, or slice-wise" in words
    assert not file.exists()
