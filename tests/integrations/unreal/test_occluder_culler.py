"""The actor for Unreal, compiled against stand-ins, hides what Python finds hidden."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.packing import pack_tree
from simplifier.io.occs_file import save_packed_tree
from tests.acceptance.command import ROOT
from tests.culling.test_culler import random_tree
from tests.integrations.c.programs import CHECKED

HERE = ROOT / "tests" / "integrations" / "unreal"
UNREAL = ROOT / "integrations" / "unreal"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if shutil.which("g++") is None:
        pytest.skip("there is no g++ here")
    made = tmp_path_factory.mktemp("unreal") / "walk_level"
    folders = [f"-I{HERE / 'stubs'}", f"-I{UNREAL}", f"-I{ROOT / 'integrations' / 'c'}"]
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", *CHECKED, *folders]
    sources = [UNREAL / "OccluderCuller.cpp", HERE / "walk_level.cpp"]
    done = subprocess.run([*command, *sources, "-o", made], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return made


def run(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)


def test_hidden_actors_are_those_whose_parts_are_all_hidden(program, tmp_path):
    """From Unreal's centimetres and left-handed axes, z up."""
    packed = pack_tree(random_tree(np.random.default_rng(4), count=200))
    save_packed_tree(packed, tmp_path / "scene.occs")
    yaw, fov = 30.0, 90.0
    eye = np.array([-35.0, 1.0, -10.0])  # of the file: y up
    turn = np.radians(yaw)
    ahead, up = np.array([np.cos(turn), 0.0, np.sin(turn)]), np.array([0.0, 1.0, 0.0])
    upright = np.degrees(2.0 * np.arctan(np.tan(np.radians(fov / 2.0)) * 180 / 320))
    camera = Camera.looking(eye, ahead, up, upright, 0.1)
    verdicts = Culler(packed, DepthBuffer(180, 320)).cull(camera).verdicts
    hidden = {
        name
        for index, name in enumerate(packed.objects)
        if (verdicts[packed.object_of == index] == Verdict.HIDDEN).all()
    }
    assert len(hidden) > 5
    kept = sorted(hidden)[0]
    names = [f"{name}:KeepShadow" if name == kept else name for name in packed.objects]
    there = 100.0 * eye[[0, 2, 1]]
    done = run(program, tmp_path / "scene.occs", *there, yaw, fov, *names, "Light")
    assert done.returncode == 0, done.stderr
    told = done.stdout.splitlines()
    assert told[0] == "Warning 1 objects of the occluders are no actors here"
    assert {line.removeprefix("hidden ") for line in told[1:]} == hidden - {kept}


@pytest.mark.parametrize("data", [b"", b"no packed scene", b"\x89OCS\r\n\x1a\n" + bytes(200)])
def test_a_file_that_is_none_hides_nothing_and_is_told(program, tmp_path, data):
    (tmp_path / "bad.occs").write_bytes(data)
    done = run(program, tmp_path / "bad.occs", 0, 0, 0, 0, 90, "thing 0")
    assert done.returncode == 1
    assert done.stdout.startswith(f"Error {tmp_path / 'bad.occs'}: ")
    assert "hidden" not in done.stdout
