"""What is installed: all that the packages need, and the commands."""

from __future__ import annotations

import platform
import subprocess
import sys
from zipfile import ZipFile

import pytest

import simplifier
from release.wheel import copy_source, make_wheel
from simplifier.kernels.compiled.code_files import SHIPPED, kernel_files
from simplifier.kernels.compiled.processors import Processor, kinds_here
from simplifier.kernels.compiled.shipping import ship
from tests.acceptance.command import ROOT, environment
from tests.solids import box

PACKAGES = "simplifier", "service"
HERE = [kind for kind in kinds_here() if kind.processor == Processor.chosen()]
needs_kind = pytest.mark.skipif(not HERE, reason="wheels hold no machine code for this processor")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The packages as a wheel has them, from a copy: the source stays as it is.

    With the machine code of one file, where there may be some.
    """
    source = tmp_path_factory.mktemp("source") / "copy"
    copy_source(source)
    if HERE:
        ship(source / SHIPPED.relative_to(ROOT), ["ears"], HERE)
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


def installed(wheel, folder):
    """Variables of a process that has the wheel in place of the source, and an empty cache."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile"]
    subprocess.run([*pip, "--target", folder / "site", wheel], check=True)
    return environment(PYTHONPATH=str(folder / "site"), NUMBA_CACHE_DIR=str(folder / "cache"))


def run(variables, *words, **options):
    # -P: the folder that it is called from would come before the wheel.
    return subprocess.run(
        [sys.executable, "-P", *words], env=variables, text=True, check=True, timeout=300, **options
    )


EARS = """
import sys
import numpy as np
import simplifier
from simplifier.kernels.ears import clip_ears
faces = np.zeros((2, 3), np.int64)
square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
assert clip_ears(square, np.arange(4), 100, faces) == 2
assert "numba" not in sys.modules
print(simplifier.__file__)
"""


@needs_kind
def test_machine_code_is_among_what_is_installed_and_is_run(built, tmp_path):
    (code,) = built.rglob("*.o")
    assert code.parent == built / SHIPPED.relative_to(ROOT)
    assert code.name.startswith("ears.")
    cache = tmp_path / "cache"
    variables = environment(PYTHONPATH=str(built), NUMBA_CACHE_DIR=str(cache))
    done = run(variables, "-c", EARS, capture_output=True)
    assert done.stdout.startswith(str(built))
    assert not cache.exists()


@pytest.mark.slow
@needs_kind
def test_machine_code_of_a_wheel_is_run_where_it_is_installed(tmp_path):
    """Made and installed by pip, which takes most of the time."""
    wheel = make_wheel(tmp_path, ["ears"], HERE)
    assert wheel.parent == tmp_path
    python, abi, system = wheel.stem.split("-")[2:]
    assert (python, abi) == (f"cp{sys.version_info.major}{sys.version_info.minor}", "none")
    assert system.endswith(platform.machine().lower())
    with ZipFile(wheel) as archive:
        (code,) = (one for one in archive.namelist() if one.endswith(".o"))
    assert code.startswith("simplifier/kernels/machine_code/ears.")
    done = run(installed(wheel, tmp_path), "-c", EARS, capture_output=True)
    assert done.stdout.startswith(str(tmp_path / "site"))
    assert not (tmp_path / "cache").exists()


@pytest.mark.slow
@needs_kind
def test_a_whole_wheel_compiles_nothing_and_makes_the_same_bytes(tmp_path):
    """A minute of compiling, for all kinds."""
    wheel = make_wheel(tmp_path, kernel_files(), kinds_here())
    with ZipFile(wheel) as archive:
        codes = [one for one in archive.namelist() if one.endswith(".o")]
    assert len(codes) == len(kernel_files()) * len(kinds_here())
    mesh = box()
    simplifier.save(simplifier.Occluder(mesh.vertices, mesh.faces), tmp_path / "box.ply")
    variables = installed(wheel, tmp_path)
    made = [tmp_path / f"{way}.glb" for way in ("wheel", "source")]
    words = ["-m", "simplifier", "simplify", "box.ply", "--preset", "draft", "-o"]
    for target, one in zip(made, (variables, environment()), strict=True):
        run(one, *words, target, cwd=tmp_path)
    assert made[0].read_bytes() == made[1].read_bytes()
    run(variables, "-m", "simplifier", "warmup", cwd=tmp_path)
    assert not list(tmp_path.rglob("cache/*.o"))
