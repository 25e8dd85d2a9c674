"""The C headers, compiled with the programs that print what they read."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
HEADERS = HERE.parents[2] / "integrations" / "c"
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
LANGUAGES = {
    "gcc": ["-std=c99"], "g++": ["-std=c++11", "-x", "c++"],
    "clang": ["-std=c99"], "clang++": ["-std=c++17", "-x", "c++"],
}  # fmt: skip
CHECKED = ["-O0", "-g1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
"""Optimising takes the compiler longer than it spares the programs."""


def compiled(folder: Path, source: str, compiler: str, *more: str) -> Path:
    """The program of a source beside this file; the test is skipped without the compiler."""
    found = _found(compiler)
    if found is None:
        pytest.skip(f"there is no {compiler} here")
    program = folder / f"{Path(source).stem}_{compiler.replace('+', 'p')}"
    command = [
        found, *LANGUAGES[compiler], *STRICT, *more, f"-I{HEADERS}", str(HERE / source),
        "-o", str(program), "-lm",
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if more and "cannot find" in done.stderr:
        return compiled(folder, source, compiler)  # no sanitizers on this machine
    assert done.returncode == 0, done.stderr
    return program


def _found(compiler: str) -> str | None:
    """Also as Debian names it, by its version."""
    names = [compiler, *(f"{compiler}-{version}" for version in range(30, 11, -1))]
    return next(filter(None, map(shutil.which, names)), None)


def printed(program: Path, *arguments: Path) -> list[list[str]]:
    """The lines about each file."""
    done = subprocess.run([program, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [part.splitlines() for part in done.stdout.split("== ")[1:]]
