"""Where machine code lies, and what it was made of.

A kernel file has a file of machine code, ``NAME.PROCESSOR-ENVIRONMENT.SOURCES.o``: a digest of all
that it runs in (the versions of Python, numba and llvmlite, what the processor can do), and one of
the sources that it was made of, those of kernels that it calls among them.  A change of any makes
another name, so code that does not belong is never found.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import logging
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
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

_log = logging.getLogger(__name__)


def find_code(name: str) -> Path | None:
    """The machine code of a kernel file for the processor chosen; None if there is none."""
    shipped = SHIPPED / code_name(name)
    return shipped if shipped.exists() else find_kept(code_name(name))


def find_kept(name: str) -> Path | None:
    """A file that was kept, here or by who installed the package; None if there is none."""
    return next((path for path in _kept(name) if _is_there(path)), None)


def _kept(name: str) -> Iterator[Path]:
    yield from (folder / name for folder in _places())
    yield writable_folder() / name  # last: it may have to be made


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

    The same order as numba has for what it caches itself.  Where none can be written, a folder that
    lasts as long as this process, which its children find by ``NUMBA_CACHE_DIR``.
    """
    places = _places()
    for place in places:
        if _can_be_written(place):
            return place
    folder = tempfile.mkdtemp(prefix="occluder_kernels_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = folder
    _log.warning(
        "compiled kernels cannot be kept, so every start compiles them again: %s cannot be written;"
        " set NUMBA_CACHE_DIR to a folder that can be",
        " and ".join(map(str, places)),
    )
    return Path(folder)


def _places() -> list[Path]:
    """Where machine code is kept, the first that can be written, and where it may have been."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(chosen)]
    places = [KERNELS / "__pycache__"]
    with suppress(RuntimeError):  # of Path.home, where nobody has this user's number
        if sys.platform == "win32":
            users = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            users = Path.home() / "Library" / "Caches"
        else:
            users = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        places.append(users / "planar-occluder" / "kernels")
    return places


def _is_there(path: Path) -> bool:
    """Also asked of places in folders that this user may not enter."""
    with suppress(PermissionError):
        return path.exists()
    return False


def _can_be_written(folder: Path) -> bool:
    """Whether files can be made in it, and it itself where it is not there."""
    there = next(one for one in (folder, *folder.absolute().parents) if _is_there(one))
    return there.is_dir() and os.access(there, os.W_OK | os.X_OK)


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
