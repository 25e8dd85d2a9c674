"""What importing the package costs, and that every exported name can be had."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import simplifier
from simplifier.io.formats import readable_suffixes, writable_suffixes
from tests.acceptance.command import environment

LIGHT = {
    "the package": "import simplifier",
    "what describes a request": (
        "from simplifier import MESH_SUFFIXES, OCCLUDER_SUFFIXES, STAGES, OptionField, Progress\n"
        "from simplifier import OptionError, OptionSet, MeshError, SimplifyOptions\n"
        "from simplifier import EvaluateOptions, SceneOptions, TradeoffOptions\n"
        "SceneOptions.fields(), TradeoffOptions.fields()\n"
        "SimplifyOptions.of({'budget': 7, 'error_bounds': [1, 2]}); EvaluateOptions()"
    ),
    "the command line": "import simplifier.cli.main",
    "what commands from outside use": "import simplifier.cli.plugin",
    "what reads TOML and writes whole files": (
        "import simplifier.io.toml, simplifier.io.files, simplifier.io.files"
    ),
}


@pytest.mark.parametrize("name", LIGHT)
def test_it_is_light(name):
    heavy = {"numpy", "numba", "scipy", "jinja2", "matplotlib", "trimesh", "lxml", "collada"}
    code = f"{LIGHT[name]}\nimport sys\nprint({heavy} & set(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment(), capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout == "set()\n"


def test_every_name_is_there_and_listed():
    for name in simplifier.__all__:
        assert getattr(simplifier, name) is not None
    assert set(simplifier.__all__) <= set(dir(simplifier))
    assert sorted(set(simplifier.__all__)) == sorted(simplifier.__all__)


def test_every_name_is_what_the_stub_says():
    tree = ast.parse(Path(simplifier.__file__).with_suffix(".pyi").read_text())
    seen = {
        alias.asname: (node.module, alias.name)
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(seen) | {"__version__"} == set(simplifier.__all__)
    for name, (module, attribute) in seen.items():
        assert getattr(sys.modules.get(f"simplifier.{module}"), attribute) is getattr(
            simplifier, name
        )


def test_other_names_are_refused():
    with pytest.raises(AttributeError, match="No simplifier attribute simplifi"):
        simplifier.simplifi  # noqa: B018


def test_submodules_are_imported_as_ever():
    code = "import simplifier.errors, simplifier\nprint(simplifier.errors.OccluderError is "
    code += "simplifier.OccluderError)\nfrom simplifier import *\nprint(simplify.__name__, load)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment(), capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("True\nsimplify <function load ")


def test_suffixes_are_those_of_the_codecs():
    assert readable_suffixes() == simplifier.MESH_SUFFIXES
    assert writable_suffixes() == simplifier.OCCLUDER_SUFFIXES
