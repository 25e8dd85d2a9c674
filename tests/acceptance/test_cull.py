"""``occluder cull`` through the real command line."""

from __future__ import annotations

import csv
import json
import os
import pty
import signal
import subprocess
from dataclasses import replace

import pytest

from simplifier.culling.flythrough_rows import COLUMNS
from simplifier.geometry.camera import CameraPath
from simplifier.hierarchy.scene_build import build_occluders
from simplifier.hierarchy.scene_file import occluder_store, write_manifest
from simplifier.io.camera_path import save_camera_path
from simplifier.io.scene import load_scene
from simplifier.io.scene_writer import write_scene
from simplifier.options.scene import SceneOptions
from tests.acceptance.command import OCCLUDER, environment, occluder, read_all, read_until
from tests.culling.occluded import looking, street

FILES = ["cull.csv", "cull.json", "cull.png", "frames.png", "walk.html"]
SMALL = ("--image", "80x45")
OPTIONS = SceneOptions(budget=12, resolution=16, moves=200, up="z", pixel_error=2.0)


@pytest.fixture(scope="module")
def town(tmp_path_factory):
    """A folder with ``town.glb``, its occluders in ``town``, and ``walk.json`` of three frames."""
    folder = tmp_path_factory.mktemp("town")
    write_scene(street(), folder / "town.glb")
    scene = load_scene(folder / "town.glb")
    build = build_occluders(scene, OPTIONS, occluder_store(folder / "town"), {})
    write_manifest(folder / "town", scene, OPTIONS, build)
    cameras = tuple(looking((x, -10.0, 3.0)) for x in (-1.0, 0.0, 1.0))
    save_camera_path(CameraPath("walk", cameras), folder / "walk.json")
    save_camera_path(CameraPath("long", cameras * 3000), folder / "long.json")
    return folder


def words(town, out, path="walk.json", **changes):
    given = {"scene": town / "town.glb", "occluders": town / "town", **changes}
    return (
        "cull", given["scene"], "--occluders", given["occluders"], "--path", town / path,
        "-o", out, *SMALL,
    )  # fmt: skip


def test_a_walk_past_a_wall(town, tmp_path):
    out = tmp_path / "deep" / "out"
    done = occluder(*words(town, out))
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == FILES
    with (out / "cull.csv").open(newline="", encoding="ascii") as file:
        *frames, total = csv.DictReader(file, strict=True)
    assert tuple(total) == COLUMNS
    assert [row["frame"] for row in frames] == ["0", "1", "2"]
    made = json.loads((out / "cull.json").read_text())
    assert made["scene"]["name"] == "town.glb"
    assert made["options"]["pixel_error"] == 2.0
    assert (made["options"]["columns"], made["options"]["rows"]) == (80, 45)
    assert made["parts"]["hidden"] == int(total["parts_hidden"]) == 12
    assert made["parts"]["culled"] > 6  # the built wall hides most of the boxes behind it
    assert made["parts"]["lost"] == 0
    assert "3 of path 'walk', 80 x 45 pixels, pixel error 2" in done.stdout
    assert f"{made['parts']['culled'] / 12:.1%}".replace("%", " % of 12 hidden") in done.stdout
    assert "hidden: visible in no pixel" in done.stdout
    for name in ("cull.png", "frames.png"):
        assert (out / name).read_bytes()[:4] == b"\x89PNG"


def test_the_pixel_error_and_the_image_are_chosen(command, town, tmp_path):
    status, output, _ = command(*words(town, tmp_path)[:-2], "--pixel-error", "1e-6", "--image",
                                "64x48")  # fmt: skip
    made = json.loads((tmp_path / "cull.json").read_text())
    assert status == 0
    assert made["options"]["pixel_error"] == 1e-6
    assert (made["options"]["columns"], made["options"]["rows"]) == (64, 48)
    assert "64 x 48 pixels, pixel error 1e-06" in output


def failure(command, *arguments):
    status, output, errors = command(*arguments)
    assert output == ""
    assert errors.count("\n") == 1
    return status, errors


def test_occluders_of_another_scene(command, town, tmp_path):
    other = street()
    other = replace(other, names=("gate", *other.names[1:]))
    write_scene(other, tmp_path / "other.glb")
    status, error = failure(command, *words(town, tmp_path / "o", scene=tmp_path / "other.glb"))
    assert status == 1
    assert "object 0 is 'gate' here and 'wall' there" in error
    assert error.endswith("build them again with 'occluder scene'\n")


def test_what_is_missing_is_named(command, town, tmp_path):
    status, error = failure(command, *words(town, tmp_path / "o", occluders=tmp_path))
    assert (status, "there is no scene.json" in error, "'occluder scene'" in error) == (
        1,
        True,
        True,
    )
    status, error = failure(command, *words(town, tmp_path / "o", scene=town / "none.glb"))
    assert (status, "none.glb: there is no such file" in error) == (1, True)
    status, error = failure(command, *words(town, tmp_path / "o", path="none.json"))
    assert (status, "none.json: there is no such file" in error) == (1, True)
    (tmp_path / "empty.json").write_text('{"schema_version": 1, "name": "", "frames": []}')
    status, error = failure(command, *words(town, tmp_path / "o", path=tmp_path / "empty.json"))
    assert (status, "at least one frame" in error) == (1, True)


def test_an_output_that_is_a_file(command, town, tmp_path):
    (tmp_path / "out").write_text("mine")
    status, error = failure(command, *words(town, tmp_path / "out"))
    assert (status, "the folder cannot be made" in error) == (1, True)
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize(
    ("more", "what"),
    [(("--image", "320"), "image: '320' is not a size"), (("--image", "0x180"), "columns: 0"),
     (("--image", "320x99999"), "rows: 99999"), (("--pixel-error", "0"), "pixel error: 0.0"),
     (("--pixel-error", "nan"), "pixel error: nan")],
)  # fmt: skip
def test_wrong_usage(command, town, tmp_path, more, what):
    status, error = failure(command, *words(town, tmp_path / "o"), *more)
    assert status == 2
    assert error.startswith(f"error: {what}")
    assert not (tmp_path / "o").exists()


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_measured(town, tmp_path):
    controller, terminal = pty.openpty()
    arguments = words(town, tmp_path / "out", "long.json")
    with subprocess.Popen(
        [*OCCLUDER, *map(os.fspath, arguments)],
        stderr=terminal, stdout=subprocess.PIPE,
        env=environment(TERM="xterm-256color", COLUMNS="120"),
    ) as process:  # fmt: skip
        os.close(terminal)
        shown = read_until(controller, b"frame 3")
        process.send_signal(signal.SIGINT)
        shown += read_all(controller)
        output = process.stdout.read().decode()
    assert process.returncode == 0
    made = json.loads((tmp_path / "out" / "cull.json").read_text())
    assert 3 <= made["frames_measured"] < made["path"]["frames"] == 9000
    assert f"{made['frames_measured']:,} of 9,000 of path 'long'" in output
    assert (
        f"warning: interrupted after {made['frames_measured']:,} of 9,000 frames" in shown.decode()
    )
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
