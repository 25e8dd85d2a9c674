"""The add-on, packed and installed as users install it, in a Blender without a window.

`make test-blender` runs these in an environment of their own, which has bpy and nothing of the
library; the command is the one of this checkout.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SOURCE = ROOT / "integrations" / "blender" / "planar_occluder"
PYTHON = ROOT / ".venv" / "bin" / "python"

ADDON = "bl_ext.user_default.planar_occluder"

if find_spec("bpy"):
    _home = tempfile.TemporaryDirectory(prefix="blender-test-")
    os.environ["BLENDER_USER_RESOURCES"] = _home.name  # read when bpy is imported
    import bpy


@pytest.fixture(scope="session")
def command(tmp_path_factory):
    """A path at which this checkout's command is."""
    path = tmp_path_factory.mktemp("bin") / "occluder"
    path.write_text(
        f"#!/bin/sh\nPYTHONPATH={shlex.quote(str(ROOT))} "
        f'exec {shlex.quote(str(PYTHON))} -m simplifier "$@"\n'
    )
    path.chmod(0o755)
    return path


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """The add-on's module."""
    archive = tmp_path_factory.mktemp("pack") / "planar_occluder.zip"
    with zipfile.ZipFile(archive, "w") as pack:
        for path in sorted(SOURCE.glob("*.*")):
            pack.write(path, path.name)
    done = bpy.ops.extensions.package_install_files(
        filepath=str(archive), repo="user_default", enable_on_install=True
    )
    assert done == {"FINISHED"}
    return sys.modules[ADDON]


@pytest.fixture(scope="session")
def part(installed):
    """``part("session")``: a module of the add-on."""
    return lambda name: sys.modules[f"{ADDON}.{name}"]


@pytest.fixture
def preferences(installed, command):
    """The add-on's, set to this checkout's command."""
    chosen = bpy.context.preferences.addons[ADDON].preferences
    chosen.maker, chosen.command, chosen.key = "COMMAND", str(command), ""
    return chosen


@pytest.fixture
def settings(preferences):
    """Of an empty scene: quick ones."""
    data = bpy.data
    for kind in (data.objects, data.meshes, data.collections, data.materials, data.node_groups):
        for item in list(kind):
            kind.remove(item)
    chosen = bpy.context.scene.planar_occluder
    for name in ("scope", "ground", "above", "smallest_hole", "transparent", "suffix"):
        chosen.property_unset(name)
    chosen.preview, chosen.budget, chosen.preset = False, 40, "draft"
    return chosen


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """The address of a service that runs."""
    if not PYTHON.exists():
        pytest.skip(f"{PYTHON} is not there: run `make test` first")
    data = tmp_path_factory.mktemp("service")
    code = "from service.cli.serve import serve; import typer; typer.run(serve)"
    variables = {"PYTHONPATH": str(ROOT), "OCCLUDER_WORKERS": "1", "OCCLUDER_MIN_FREE": "0"}
    log = (data / "log").open("w")
    with log, subprocess.Popen(
        [PYTHON, "-c", code, "--port", "0", "--data", data / "data"],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=log, text=True,
        env={**os.environ, **variables},
    ) as process:  # fmt: skip
        try:
            line = process.stdout.readline()
            assert line.startswith("occluder serves at http://"), (data / "log").read_text()
            yield line.split()[-1]
        finally:
            process.kill()
