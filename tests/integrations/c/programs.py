"""The C headers, compiled with the programs that print what they read."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
HEADERS = HERE.parents[2] / "integrations" / "c"
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]
LANGUAGES = {"gcc": ["-std=c99"], "g++": ["-std=c++11", "-x", "c++"]}
CHECKED = ["-O0", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
"""Optimising takes the compiler longer than it spares the programs."""


def compiled(folder: Path, source: str, compiler: str, *more: str) -> Path:
    """The program of a source beside this file; the test is skipped without the compiler."""
    if shutil.which(compiler) is None:
        pytest.skip(f"there is no {compiler} here")
    program = folder / f"{Path(source).stem}_{compiler.replace('+', 'p')}"
    command = [
        compiler, *LANGUAGES[compiler], *STRICT, *more, f"-I{HEADERS}", str(HERE / source),
        "-o", str(program),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True)
    if more and "cannot find" in done.stderr:
        return compiled(folder, source, compiler)  # no sanitizers on this machine
    assert done.returncode == 0, done.stderr
    return program


def printed(program: Path, *arguments: Path) -> list[list[str]]:
    """The lines about each file."""
    done = subprocess.run([program, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [part.splitlines() for part in done.stdout.split("== ")[1:]]
