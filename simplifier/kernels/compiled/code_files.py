"""Where machine code lies, and what it was made of.

A kernel file has a file of machine code, ``NAME.PROCESSOR-ENVIRONMENT.SOURCES.o``: a digest of all
that it runs in (the versions of Python, numba and llvmlite, what the processor can do), and one of
the sources that it was made of, those of kernels that it calls among them.  A change of any makes
another name, so code that does not belong is never found.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import sys
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm

from simplifier.kernels.compiled.processors import Processor

_COMPILED = Path(__file__).parent
KERNELS = _COMPILED.parent
SHIPPED = KERNELS / "machine_code"
"""What a wheel or an image brings along; a checkout has none."""
_IMPORT = re.compile(r"^from simplifier\.kernels\.(\w+) import", re.MULTILINE)
_MADE_BY = (
    "boxes.py", "control.py", "counting.py", "crossings.py", "drawing.py", "edges.py", "erosion.py",
    "intrinsic.py", "kernel.py", "lanes.py", "processors.py", "rows.py", "small_faces.py",
    "turned_erosion.py", "compiler/arrays.py", "compiler/builder.py", "compiler/building.py",
    "compiler/front_end.py", "compiler/lowering.py", "compiler/ranges.py", "compiler/variables.py",
)  # fmt: skip
"""Whose changes change the code."""


def find_code(name: str) -> Path | None:
    """The machine code of a kernel file for the processor chosen; None if there is none."""
    paths = (folder / code_name(name) for folder in (SHIPPED, writable_folder()))
    return next((path for path in paths if path.exists()), None)


def code_name(name: str) -> str:
    """The name of the file that holds the machine code of a kernel file."""
    return f"{name}.{_environment()}.{_sources(name)}.o"


def write_code(folder: Path, name: str, code: bytes) -> None:
    """Write it, all or nothing, and remove what earlier sources gave in the same environment."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / code_name(name)
    descriptor, temporary = tempfile.mkstemp(prefix=".", suffix=".part", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(code)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
    # numba does not see that a kernel of another file has changed in what it keeps itself.
    for older in (
        *folder.glob(f"{name}.{_environment()}.*.o"),
        *folder.glob(f"{name}.*.nbi"),
    ):
        if older != path:
            older.unlink(missing_ok=True)


@cache
def writable_folder() -> Path:
    """``NUMBA_CACHE_DIR`` if it is set, else beside the kernels, else in the user's cache.

    The same order as numba has for what it caches itself.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    beside = KERNELS / "__pycache__"
    if os.access(beside if beside.exists() else KERNELS, os.W_OK):
        return beside
    if sys.platform == "win32":
        users = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        users = Path.home() / "Library" / "Caches"
    else:
        users = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return users / "planar-occluder" / "kernels"


def kernel_files() -> list[str]:
    """The names of all kernel files, without the suffix."""
    return sorted(path.stem for path in KERNELS.glob("*.py") if path.stem != "__init__")


@cache
def _environment() -> str:
    kind = sys.implementation.cache_tag, _numba_version(), llvmlite.__version__
    processor = Processor.chosen()
    digest = _digest([*kind, llvm.get_process_triple(), processor.name, processor.features], 8)
    return f"{processor.name}-{digest}"


def _numba_version() -> str:
    """What tells it: importing numba, or looking for its metadata, takes long."""
    package = importlib.util.find_spec("numba")
    if package is None or package.origin is None:
        raise ImportError("numba is not installed")
    return Path(package.origin).with_name("_version.py").read_text("utf-8")


@cache
def _sources(name: str) -> str:
    return _digest([*map(_source, _needed(name)), *_makers()], 16)


@cache
def _makers() -> list[str]:
    """The sources of what makes machine code."""
    return [(_COMPILED / maker).read_text("utf-8") for maker in _MADE_BY]


def _needed(name: str) -> list[str]:
    """A kernel file, and those that it imports, near or far."""
    found = [name]
    for one in found:
        found += sorted(set(_IMPORT.findall(_source(one))) - set(found))
    return found


@cache
def _source(name: str) -> str:
    path = KERNELS / f"{name}.py"
    return path.read_text("utf-8") if path.exists() else ""


def _digest(texts: Iterable[str], length: int) -> str:
    found = hashlib.sha256()
    for text in texts:
        found.update(text.encode())
        found.update(b"\0")
    return found.hexdigest()[:length]
