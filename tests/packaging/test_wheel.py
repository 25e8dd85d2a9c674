"""What is installed: all that the packages need, and the commands."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

from tests.acceptance.command import ROOT

PACKAGES = "simplifier", "service"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The packages as a wheel has them, from a copy: the source stays as it is."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, source)
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    code = "from setuptools import setup; setup(script_args=['-q', 'build_py', '-d', 'built'])"
    subprocess.run([sys.executable, "-c", code], cwd=source, check=True, capture_output=True)
    return source / "built"


def files_below(folder):
    return {
        path.relative_to(folder)
        for package in PACKAGES
        for path in (folder / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_no_file_of_the_packages_is_left_out(built):
    assert files_below(ROOT) - files_below(built) == set()
