"""The Unity postprocessor, compiled and run against a stand-in of Unity's classes."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.command import ROOT
from tests.integrations.commands import make_command

SCRIPT = ROOT / "integrations" / "unity" / "OccluderPostprocessor.cs"
HERE = Path(__file__).parent
WEDGE = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]]) + np.array([0.5, 0.25, -4])

pytestmark = pytest.mark.skipif(
    not (shutil.which("mcs") and shutil.which("mono")),
    reason="the C# compiler mcs is not installed (Debian's mono-mcs)",
)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    built = tmp_path_factory.mktemp("unity") / "import.exe"
    sources = [SCRIPT, HERE / "UnityStub.cs", HERE / "Import.cs"]
    command = ["mcs", "-langversion:7", "-warnaserror", "-nowarn:649", f"-out:{built}", *sources]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return built


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    return make_command(tmp_path_factory.mktemp("bin"))


def imported(program, project, command, options, *materials):
    """Import Wedge.fbx of a project; what the program prints, by the first word of its lines.

    ``materials``  of a wedge each, as "3000:glass", render queue and name.
    """
    if options is not None:
        (project / "Wedge.fbx.occluder").write_text(options)
    done = subprocess.run(
        ["mono", program, "Wedge.fbx", *materials],
        cwd=project, capture_output=True, text=True, timeout=120,
        env={**os.environ, "TEST_COMMAND": str(command)}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = {}
    for line in done.stdout.splitlines():
        word, _, rest = line.partition(" ")
        if not rest.startswith(("Wedge.fbx: weak: ", "Wedge.fbx: unusable: ")):
            found.setdefault(word, []).append(rest)
    assert list((project / "Temp").glob("*")) == []
    return found


def numbers(lines):
    return np.array([line.split() for line in lines], dtype=float)


def test_a_model_gets_a_child_that_occludes_in_its_place(program, tmp_path, command):
    found = imported(program, tmp_path, command, "--budget 8\n--preset draft\n")
    assert found["child"] == ["Wedge_Occluder OccluderStatic"]
    assert found["stored"] == ["True"]
    assert found["part"] == ["BatchingStatic, OccludeeStatic"]
    vertices, faces = numbers(found["vertex"]), numbers(found["face"]).astype(int)
    assert len(faces) == 4
    distances = np.linalg.norm(vertices[:, None] - WEDGE[None], axis=2)
    np.testing.assert_allclose(distances.min(axis=0), 0.0, atol=1e-6)
    np.testing.assert_allclose(distances.min(axis=1), 0.0, atol=1e-6)
    # Unity's front is clockwise in a left-handed space: by the numbers, normals point outwards.
    a, b, c = vertices[faces].transpose(1, 0, 2)
    outwards = (a + b + c) / 3.0 - WEDGE.mean(axis=0)
    assert (np.sum(np.cross(b - a, c - a) * outwards, axis=1) > 0.0).all()


def test_a_model_without_a_file_of_options_stays_as_it_is(program, tmp_path, command):
    found = imported(program, tmp_path, command, None)
    assert set(found) == {"depends", "part"}
    assert found["depends"] == ["Wedge.fbx.occluder"]
    assert found["part"] == ["OccluderStatic, BatchingStatic"]


def test_what_the_command_refuses_is_an_error_of_the_import(program, tmp_path, command):
    found = imported(program, tmp_path, command, "--budget 0")
    (error,) = found["error"]
    assert error.startswith("Wedge.fbx: no occluder was made: ")
    assert "budget" in error
    assert "child" not in found


def wedges(found):
    """Where the occluder's wedges stand, by the number of their material."""
    return set((numbers(found["vertex"])[:, 0] // 10).astype(int).tolist())


def test_what_one_can_see_through_is_left_out_and_told_of(program, tmp_path, command):
    # 2449 is the last queue of what is opaque, 2450 the first of what is cut out.
    found = imported(
        program, tmp_path, command, "--preset draft",
        "2449:wall", "2450:ivy, dry", "3000:glass", "none", "3000:glass",
    )  # fmt: skip
    assert wedges(found) == {0, 3}
    assert found["warning"] == [
        "Wedge.fbx: 12 see-through triangles were left out (material 'ivy, dry', "
        "material 'glass'); keep them with --transparent keep (transparent=\"keep\" in Python)"
    ]


@pytest.mark.parametrize("option", ["--transparent keep", "--transparent=keep"])
def test_what_one_can_see_through_is_kept_by_the_option(program, tmp_path, command, option):
    options = f"--preset draft\n{option}"
    found = imported(program, tmp_path, command, options, "2000:wall", "3000:glass")
    assert wedges(found) == {0, 1}
    assert "warning" not in found


def test_names_of_materials_may_be_anything(program, tmp_path, command):
    """One that opaque ones have too, none, and such as end or join the lines of a file."""
    found = imported(
        program, tmp_path, command, "--preset draft",
        "2000:", "2000:same", "3000:same", "3000:", "3000:back\\", "3000:two\nlines", "2000:wall",
    )  # fmt: skip
    assert wedges(found) == {0, 1, 6}
    assert found["warning"][0].startswith(
        "Wedge.fbx: 16 see-through triangles were left out (material 'same', "
        "material 'unnamed', material 'back', material 'two lines');"
    )


def test_a_model_that_is_all_glass_is_an_error_of_the_import(program, tmp_path, command):
    found = imported(program, tmp_path, command, "", "3000:glass")
    (error,) = found["error"]
    assert "nothing opaque is left: 4 see-through triangles were left out" in error
    assert "child" not in found


def test_a_command_that_is_not_there_is_an_error_of_the_import(program, tmp_path):
    found = imported(program, tmp_path, tmp_path / "none", "")
    assert found["error"][0].startswith("Wedge.fbx: no occluder was made: ")
