"""``occluder pvs --pictures``, ``--backend``, and ``pvs-show --pictures``, as users run them."""

from __future__ import annotations

import json
import sys

import cv2
import numpy as np
import pytest

import simplifier
from bench.visibility_city import generated_city, street_cells
from simplifier.errors import BackendUnavailableError
from simplifier.io.scene_writer import write_scene
from simplifier.visibility.cull_maps.cull_map_gl import check_opengl

NAMES = ("largest.png", "median.png", "smallest.png", "umbra.png", "cells.png")
PLAN = {"cell": (181, 0, 79), "seen": (0, 114, 178), "hidden": (207, 207, 202)}


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A small city, z up, and a file of street cells."""
    path = tmp_path_factory.mktemp("town") / "town.glb"
    city = generated_city(3)
    write_scene(city, path)
    places = street_cells(city, 5)
    boxes = [
        {"low": low.tolist(), "high": high.tolist()}
        for low, high in zip(places.low, places.high, strict=True)
    ]
    path.with_suffix(".json").write_text(json.dumps({"cells": boxes}))
    return path


def found(command, town, file, *more):
    return command(
        "pvs", town, "-o", file, "--up", "z", "--cells", town.with_suffix(".json"), *more
    )


@pytest.mark.slow
def test_pictures_of_sets(command, town, tmp_path):
    folder = tmp_path / "pictures" / "here"
    status, _, errors = found(command, town, tmp_path / "town.pvs", "--pictures", folder)
    assert (status, errors) == (0, "")
    # Strong occluders come first among so convex houses.
    assert sorted(one.name for one in folder.iterdir()) == sorted((*NAMES, "strong.png"))
    for name in NAMES:
        image = cv2.imread(str(folder / name))[..., ::-1]
        assert min(image.shape[:2]) > 500
        if name in NAMES[:3]:
            plan = image[: int(0.88 * len(image))]
            for colour in PLAN.values():
                assert (np.abs(plan.astype(int) - colour) <= 2).all(axis=2).sum() > 100


@pytest.mark.slow
def test_strong_occluders_are_drawn_by_themselves(command, town, tmp_path):
    folder = tmp_path / "strong"
    more = ("--method", "strong", "--pictures", folder)
    assert found(command, town, tmp_path / "strong.pvs", *more)[0] == 0
    names = sorted(one.name for one in folder.iterdir())
    assert names == sorted({*NAMES, "strong.png"} - {"umbra.png"})
    assert min(cv2.imread(str(folder / "strong.png")).shape[:2]) > 500


def test_pictures_of_a_file_alone(command, town, tmp_path):
    file = tmp_path / "town.pvs"
    assert found(command, town, file)[0] == 0
    status, told, _ = command("pvs-show", file, "--pictures", tmp_path / "out")
    assert status == 0
    assert "cull-map, conservative" in told
    assert cv2.imread(str(tmp_path / "out" / "cells.png")) is not None


def test_a_file_is_no_folder_for_pictures(command, town, tmp_path):
    file = tmp_path / "town.pvs"
    status, _, errors = found(command, town, file, "--pictures", town)
    assert status == 1
    assert "this is not a folder" in errors
    assert not file.exists()


def test_opengl_finds_sets_that_pass_the_check(command, town, tmp_path):
    try:
        check_opengl()
    except BackendUnavailableError as error:
        pytest.skip(str(error))
    drawn, computed = tmp_path / "drawn.pvs", tmp_path / "computed.pvs"
    status, told, errors = found(command, town, drawn, "--backend", "opengl")
    assert (status, errors) == (0, "")
    assert "5 of 5, 0 kept from before" in told
    assert command("pvs-check", town, drawn, "--cells", "5", "--views", "20")[0] == 0
    assert found(command, town, computed)[0] == 0
    one, other = simplifier.load_pvs(drawn), simplifier.load_pvs(computed)
    sizes = [sum(int(held.visible(cell).sum()) for cell in range(5)) for held in (one, other)]
    assert 0.8 < sizes[0] / sizes[1] < 1.2
    # Sets by another backend are found anew.
    assert "0 kept from before" in found(command, town, drawn)[1]


def test_a_machine_without_opengl(command, town, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    file = tmp_path / "town.pvs"
    status, _, errors = found(command, town, file, "--backend", "opengl")
    assert status == 1
    assert "backend opengl: the Python package moderngl is missing" in errors
    assert "or use --backend cpu" in errors
    assert not file.exists()
    assert found(command, town, file, "--backend", "magic")[0] == 2
