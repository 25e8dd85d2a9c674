"""What importing the package costs, and that every exported name can be had."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import simplifier.io
from simplifier.io import readable_suffixes, writable_suffixes
from tests.acceptance.command import environment

LIGHT = {
    "the package": "import simplifier",
    "what describes a request": (
        "from simplifier import SIMPLIFY_FIELDS, EVALUATE_FIELDS, SCENE_FIELDS, MESH_SUFFIXES, "
        "OCCLUDER_SUFFIXES, STAGES, OptionField, OptionError, MeshError, Progress\n"
        "from simplifier import SimplifyOptions, EvaluateOptions\n"
        "from simplifier import TradeoffOptions, TRADEOFF_FIELDS\n"
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
    code = f"{LIGHT[name]}\nimport sys\nprint({{'numpy', 'numba', 'scipy'}} & set(sys.modules))"
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


def test_type_checkers_see_the_names_that_there_are():
    tree = ast.parse(Path(simplifier.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in block.body
        for alias in node.names
    }
    assert set(seen) | {"__version__"} == set(simplifier.__all__)
    for name, (module, attribute) in seen.items():
        assert getattr(sys.modules.get(module), attribute) is getattr(simplifier, name)


def test_other_names_are_refused():
    with pytest.raises(AttributeError, match="'simplifier' has no attribute 'simplifi'"):
        simplifier.simplifi  # noqa: B018


def test_submodules_are_imported_as_ever():
    code = "import simplifier.errors, simplifier\nprint(simplifier.errors.OccluderError is "
    code += "simplifier.OccluderError)\nfrom simplifier import *\nprint(simplify.__name__, load)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment(), capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.startswith("True\nsimplify <function load_mesh")


def test_suffixes_are_those_of_the_codecs():
    assert readable_suffixes() == simplifier.MESH_SUFFIXES
    assert writable_suffixes() == simplifier.OCCLUDER_SUFFIXES


def test_every_name_of_the_files_is_there():
    for name in simplifier.io.__all__:
        assert callable(getattr(simplifier.io, name))
    with pytest.raises(AttributeError, match=r"'simplifier\.io' has no attribute 'load_mush'"):
        simplifier.io.load_mush  # noqa: B018


def test_no_name_of_the_files_is_that_of_a_module():
    modules = {path.stem for path in Path(simplifier.io.__file__).parent.glob("*.py")}
    assert not modules & set(simplifier.io.__all__)  # which would be found in its place
