"""The wheel that brings its machine code along: ``python -m release.wheel [FOLDER]``.

Where it is installed, processors of the kinds in ``processors.py`` compile nothing.  It is for this
operating system and version of Python.  Its machine code is for the versions of numba and llvmlite
that made it: beside others, kernels are compiled on first use, as they are from the source.
"""

from __future__ import annotations

import argparse
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from pathlib import Path

from simplifier.kernels.compiled.code_files import SHIPPED, kernel_files
from simplifier.kernels.compiled.processors import Kind, kinds_here
from simplifier.kernels.compiled.shipping import ship

ROOT = Path(__file__).parents[1]
_PACKAGES = "simplifier", "service"
_FILES = "pyproject.toml", "README.md"
_GLIBC = "2_27"
"""The oldest C library for which numba has wheels; the machine code itself asks for none."""


def make_wheel(folder: Path, names: Sequence[str], kinds: Sequence[Kind]) -> Path:
    """Write the wheel with the machine code of some kernel files for some kinds; returns its path.

    Raises :class:`~simplifier.kernels.compiled.library.BuildError`, or CalledProcessError where pip
    fails.
    """
    with tempfile.TemporaryDirectory() as place:
        # A copy, so that the source has no machine code that its next change leaves behind.
        source, made = Path(place) / "source", Path(place) / "made"
        copy_source(source)
        ship(source / SHIPPED.relative_to(ROOT), names, kinds)
        subprocess.run(
            [
                sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps",
                "--no-build-isolation", "--wheel-dir", str(made),
                f"--config-settings=--build-option=--python-tag={_python_tag()}",
                f"--config-settings=--build-option=--plat-name={_platform_tag()}", str(source),
            ],
            check=True,
        )  # fmt: skip
        (wheel,) = made.glob("*.whl")
        folder.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(wheel, folder))


def copy_source(target: Path) -> None:
    """All that a wheel is made of."""
    target.mkdir(parents=True)
    for name in _FILES:
        shutil.copy(ROOT / name, target)
    for name in _PACKAGES:
        shutil.copytree(ROOT / name, target / name, ignore=shutil.ignore_patterns("__pycache__"))


def _python_tag() -> str:
    return f"cp{sys.version_info.major}{sys.version_info.minor}"


def _platform_tag() -> str:
    if sys.platform == "linux" and platform.libc_ver()[0] == "glibc":
        return f"manylinux_{_GLIBC}_{platform.machine()}"
    return sysconfig.get_platform().replace("-", "_").replace(".", "_")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m release.wheel")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out/wheels"))
    print(make_wheel(parser.parse_args().folder, kernel_files(), kinds_here()))


if __name__ == "__main__":
    main()
