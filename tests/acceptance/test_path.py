"""``occluder path``: what it writes, what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from simplifier.geometry.occluder import Occluder
from simplifier.io.camera_path import load_camera_path
from simplifier.io.save import save_occluder
from tests.acceptance.command import occluder
from tests.walkable import two_boxes


@pytest.fixture(scope="module")
def street(tmp_path_factory):
    """Two houses on a ground, z up, one mesh."""
    mesh = two_boxes().joined([0, 1, 2])
    path = tmp_path_factory.mktemp("scene") / "street.glb"
    save_occluder(Occluder(mesh.vertices, mesh.faces), path)
    return path


def test_a_path_is_written_twice_the_same(here, street, tmp_path):
    """In a process of its own, and in this one."""
    for name, run in (("one.json", occluder), ("two.json", here)):
        done = run(
            "path", street, "-o", tmp_path / name, "--kind", "street", "--frames", "12", "--up",
            "z", "--eye-height", "1.5", "--fov", "75", "--seed", "3",
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        assert "12 frames of kind street" in done.stdout
    data = (tmp_path / "one.json").read_bytes()
    assert data == (tmp_path / "two.json").read_bytes()
    path = load_camera_path(tmp_path / "one.json")
    assert path.name == json.loads(data)["name"] == "street"
    assert len(path.cameras) == 12
    assert all(camera.fov == 75.0 for camera in path.cameras)
    assert np.array([c.position[2] for c in path.cameras]) == pytest.approx(1.5, abs=1e-6)


def test_a_folder_is_a_scene(command, street, tmp_path):
    assert command("path", street.parent, "-o", tmp_path / "p.json", "--kind", "roof")[0] == 0
    assert len(load_camera_path(tmp_path / "p.json").cameras) == 60


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("--frames", "0"), 2, "frames: 0 is out of range"),
        (("--eye-height", "-1"), 2, "eye height: -1.0 is not a length"),
        (("--fov", "nan"), 2, "fov: nan is out of range"),
        (("--kind", "flight"), 2, "'flight' is not one of"),
        (("--kind", "inside", "--eye-height", "30"), 1, "no room for a path of kind inside"),
    ],
)
def test_refusals_are_one_line(command, street, tmp_path, arguments, status, words):
    done = command("path", street, "-o", tmp_path / "p.json", "--up", "z", *arguments)
    assert (done[0], done[1]) == (status, "")
    assert words in done[2]
    assert done[2].startswith("error: ")
    assert done[2].count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_the_scene_is_not_overwritten(command, street):
    before = street.read_bytes()
    status, _, errors = command("path", street, "-o", street)
    assert (status, street.read_bytes()) == (1, before)
    assert "this is the scene itself" in errors


def test_places_that_cannot_be_read_or_written(command, street, tmp_path):
    status, _, errors = command("path", tmp_path / "none.glb", "-o", tmp_path / "p.json")
    assert status == 1
    assert "there is no such file" in errors
    status, _, errors = command("path", street, "-o", tmp_path / "none" / "p.json")
    assert status == 1
    assert "there is no folder" in errors
