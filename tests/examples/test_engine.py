"""The example for engines is compiled and names what Python finds visible."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from simplifier.culling.culler import Culler
from simplifier.culling.depth_buffer import DepthBuffer, Verdict
from simplifier.geometry.camera import Camera
from simplifier.hierarchy.packing import pack_tree
from simplifier.io.occs_file import save_packed_tree
from tests.culling.test_culler import random_tree

EXAMPLE = Path(__file__).parents[2] / "examples" / "engine"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler here")
    made = tmp_path_factory.mktemp("engine") / "cull"
    headers = EXAMPLE.parents[1] / "integrations" / "c"
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", f"-I{headers}"]
    subprocess.run([*command, EXAMPLE / "cull.c", "-o", made, "-lm"], check=True)
    return made


def test_it_names_what_may_be_seen(program, tmp_path):
    packed = pack_tree(random_tree(np.random.default_rng(4), count=300))
    save_packed_tree(packed, tmp_path / "scene.occs")
    hidden = 0
    for place in ((-40.0, -4.0, -4.0), (-10.0, 0.0, 0.0)):
        done = subprocess.run(
            [program, tmp_path / "scene.occs", *map(str, place)],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        ahead = np.array([1.0, 0.1, 0.1])
        up = np.eye(3)["xyz".index(packed.up)]
        camera = Camera.looking(np.array(place), ahead, up, 60.0, 0.1)
        verdicts = Culler(packed, DepthBuffer(180, 320)).cull(camera).verdicts
        seen = packed.object_of[verdicts == Verdict.VISIBLE]
        assert done.stdout.split("\n")[:-1] == [packed.objects[index] for index in seen]
        hidden += np.count_nonzero(verdicts == Verdict.HIDDEN)
    assert hidden > 0


def test_it_says_what_it_needs(program, tmp_path):
    done = subprocess.run([program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "usage: cull scene.occs X Y Z" in done.stderr
