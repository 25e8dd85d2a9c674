"""Kernels of a test as machine code, made as those of the package are, and as plain Python."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from simplifier.kernels.compiled.loading import load_code
from tests.acceptance.command import environment

DECORATORS = "from simplifier.kernels.compiled.kernel import inner_kernel, kernel"
_PLAIN = "inner_kernel, kernel = lambda f: f, lambda takes: inner_kernel"
_COMPILE = """
import sys
from pathlib import Path
from simplifier.kernels.compiled.compiler import building, front_end

folder, *names = sys.argv[1:]
sys.path.insert(0, folder)
building._PACKAGE = front_end._PACKAGE = "sample"
context = building._only_lower()
for name in names:
    (Path(folder) / f"{name}.o").write_bytes(building.compile_file(name, context))
"""


def compile_sample(folder: Path, sources: Mapping[str, str]) -> None:
    """Write the machine code ``NAME.o`` of each source into a folder."""
    package = folder / "sample"
    package.mkdir()
    (package / "__init__.py").touch()
    for name, source in sources.items():
        (package / f"{name}.py").write_text(source)
    command = [sys.executable, "-c", _COMPILE, str(folder), *sources]
    subprocess.run(command, env=environment(), timeout=300, check=True)


def both(folder: Path, source: str, *names: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The functions of those names as machine code, and as they were written."""
    compile_sample(folder, {"kernels": source})
    return load_code(folder / "kernels.o", list(names)), written(source)


def written(source: str) -> dict[str, Callable[..., Any]]:
    """The functions of a source as plain Python."""
    found: dict[str, Callable[..., Any]] = {}
    exec(source.replace(DECORATORS, _PLAIN), found)
    return found
