"""A new option is written into its dataclass and its stage, and is everywhere."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest
import yaml

from tests.acceptance.command import ROOT, environment

FIELD = """    glow: float = option(0.25, "How much it glows, from 0 to 2.", low=0.0, high=2.0)
"""
STAGE = """    glow: float = shared(SimplifyOptions, "glow")
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the code with the option in its class and in that of the stage that uses it."""
    place = tmp_path_factory.mktemp("tree")
    for package in ("simplifier", "service"):
        # With byte code, which holds for what is not changed; numba's files beside it are large.
        shutil.copytree(
            ROOT / package, place / package, ignore=shutil.ignore_patterns("*.nbc", "*.nbi")
        )
    insert(place / "simplifier/options/simplify.py", "class SimplifyOptions(", FIELD)
    insert(place / "simplifier/options/stages.py", "class SelectionOptions(", STAGE)
    return place


def insert(path, head, line):
    """Put a line behind the last field of a class."""
    text = path.read_text()
    end = text.index("    def __post_init__" if "post_init" in text else "\n\n\n", text.index(head))
    path.write_text(text[:end].rstrip() + "\n" + line + "\n" + text[end:])


def run(tree, *arguments):
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=tree, env=environment(PYTHONPATH=str(tree), COLUMNS="200"),
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    return done.stdout


def test_the_command_has_it(tree):
    shown = run(tree, "-m", "simplifier", "simplify", "--help")
    assert "--glow" in shown
    assert "How much it glows, from 0 to 2." in shown
    assert "[default: 0.25]" in shown
    refused = subprocess.run(
        [sys.executable, "-m", "simplifier", "simplify", "none.obj", "-o", "a.glb", "--glow", "3"],
        cwd=tree, env=environment(PYTHONPATH=str(tree)), capture_output=True, text=True,
        timeout=120, check=False,
    )  # fmt: skip
    assert (refused.returncode, refused.stderr) == (
        2, "error: glow: 3.0 is out of range; choose 0.0 to 2.0\n",
    )  # fmt: skip


def test_http_has_it(tree):
    code = """
from service.openapi import document
print(document())
"""
    paths = yaml.safe_load(run(tree, "-c", code))["paths"]
    (one,) = [one for one in paths["/v1/occluders"]["post"]["parameters"] if one["name"] == "glow"]
    assert one["description"] == "How much it glows, from 0 to 2."
    assert one["schema"] == {"type": "number", "minimum": 0.0, "maximum": 2.0, "default": 0.25}


def test_python_has_it_and_it_reaches_its_stage(tree):
    code = """
import simplifier
from simplifier.options.stages import stage_options
chosen = simplifier.SimplifyOptions(glow=1.5)
print(stage_options(chosen, 1.0).selection.glow, simplifier.SimplifyOptions.of({}).glow)
try:
    simplifier.SimplifyOptions(glow=2.5)
except simplifier.OptionError as error:
    print(error)
"""
    assert run(tree, "-c", code).splitlines() == [
        "1.5 0.25", "glow: 2.5 is out of range; choose 0.0 to 2.0",
    ]  # fmt: skip


def test_manifests_have_it(tree):
    code = """
from pathlib import Path
from simplifier.builds.manifest import read_manifest
Path("occluders.toml").write_text('[[asset]]\\nfiles = "*.obj"\\nglow = 3\\n')
from simplifier.errors import ManifestError
try:
    read_manifest(Path("occluders.toml"))
except ManifestError as error:
    print(error)
"""
    assert "glow: 3 is out of range; choose 0.0 to 2.0" in run(tree, "-c", code)
