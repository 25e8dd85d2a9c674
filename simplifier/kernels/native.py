"""The C headers of ``integrations/c`` as kernels, where this machine has a C compiler.

They fill arrays as the kernels of :mod:`depth_buffer` and :mod:`box_verdict` do, bit by bit, in a
fraction of the time.  They are compiled on first use and kept where the kernels' code is kept;
without a compiler :func:`library` is None, and numba's kernels do the work
(``docs/decisions/0031-headers-compiled-on-first-use.md``).
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from simplifier.kernels.compiled.code_files import find_kept, writable_folder
from simplifier.kernels.compiled.kernel import PLAIN

SWITCH = "OCCLUDER_NATIVE"
"""Environment: "off" leaves the headers aside."""

_HERE = Path(__file__).parent
_SOURCES = ("native.c", "occluder_buffer.h", "occluder_tree.h")
# Products and sums are rounded one by one, as numba's are.
_FLAGS = ("-O3", "-std=c99", "-ffp-contract=off", "-fvisibility=hidden", "-shared", "-fPIC")
_SECONDS = 120.0  # that a compiler may take, which needs two


@cache
def library() -> ctypes.CDLL | None:
    """What this machine can run; None where that is nothing."""
    if os.environ.get(SWITCH, "").lower() == "off" or PLAIN:
        return None
    compiler = "" if platform.system() == "Windows" else os.environ.get("CC") or "cc"
    sources = _read_sources()
    if shutil.which(compiler) is None or sources is None:
        return None
    x86 = platform.machine().lower() in ("x86_64", "amd64")
    for flags in ((*_FLAGS, "-mavx2"), _FLAGS) if x86 else (_FLAGS,):
        found = _loaded(compiler, flags, sources)
        if found is not None and found.occluder_native_runs():
            return _declared(found)
    return None


def _read_sources() -> bytes | None:
    try:
        return b"\0".join((_HERE / name).read_bytes() for name in _SOURCES)
    except OSError:
        return None


def _loaded(compiler: str, flags: tuple[str, ...], sources: bytes) -> ctypes.CDLL | None:
    """Named after all that it hangs on, so that what was compiled before is right or not there."""
    given = "\0".join((compiler, *flags, platform.platform())).encode()
    name = f"native_{hashlib.blake2b(given + sources, digest_size=8).hexdigest()}.so"
    with suppress(OSError):
        path = find_kept(name)
        if path is None:
            path = writable_folder() / name
            path.parent.mkdir(parents=True, exist_ok=True)
            _compile(compiler, flags, path)
        return ctypes.CDLL(str(path))
    return None


def _compile(compiler: str, flags: tuple[str, ...], target: Path) -> None:
    """Whole or not at all, whoever else does the same.  Raises :class:`OSError`."""
    with tempfile.TemporaryDirectory(prefix="native", dir=target.parent) as folder:
        made = Path(folder) / target.name
        command = [compiler, *flags, str(_HERE / _SOURCES[0]), "-o", str(made), "-lm"]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=_SECONDS)
        except subprocess.SubprocessError as error:
            raise OSError(str(error)) from None
        made.replace(target)


def address(array: Any) -> int:
    """Of a contiguous array's first number; the array has to live as long as it is used."""
    return int(array.__array_interface__["data"][0])


class Buffer(ctypes.Structure):
    """``native_buffer`` of ``native.c``."""

    _fields_ = (
        ("depth", ctypes.c_void_p), ("points", ctypes.c_void_p), ("eye", ctypes.c_void_p),
        ("axes", ctypes.c_void_p), ("lens", ctypes.c_void_p), ("rows", ctypes.c_int64),
        ("columns", ctypes.c_int64), ("most_vertices", ctypes.c_int64), ("inner", ctypes.c_int64),
    )  # fmt: skip


class Counts(NamedTuple):
    """What a walk drew, and how many nodes it met."""

    occluders: int
    triangles: int
    nodes: int


class NativeTree:
    """The bytes of an ``.occs`` file, opened; there has to be a :func:`library`.

    Raises :class:`ValueError` for what the header refuses.

    ``drawn``  (k, 2) uint32: node and level of the occluders of the last frame.
    """

    def __init__(self, data: bytes) -> None:
        found = library()
        assert found is not None
        self._library = found
        words = np.zeros(-(-len(data) // 8), dtype=np.uint64)  # aligned
        words.view(np.uint8)[: len(data)] = np.frombuffer(data, np.uint8)
        self._words, sizes = words, np.zeros(3, dtype=np.int64)
        self._tree = np.zeros(-(-found.occluder_native_tree_bytes() // 8), dtype=np.uint64)
        status = found.occluder_native_open(
            address(words), len(data), address(self._tree), address(sizes)
        )
        if status != 0:
            raise ValueError(f"occluder_tree_open() gives {status}")
        self._room = np.zeros(-(-int(sizes[0]) // 8), dtype=np.uint64)
        self.most_vertices = int(sizes[2])
        self.drawn = np.zeros((int(sizes[1]), 2), dtype=np.uint32)
        self._counts = np.zeros(3, dtype=np.int64)

    def cull(self, buffer: Buffer, pixel_error: float, most: int, verdicts: int) -> Counts:
        """A frame in a buffer that was cleared; ``verdicts`` is where those of the parts go."""
        self._library.occluder_native_cull(
            buffer, address(self._tree), address(self._room), pixel_error, most,
            address(self.drawn), verdicts, address(self._counts),
        )  # fmt: skip
        return Counts(*self._counts.tolist())


def _declared(found: ctypes.CDLL) -> ctypes.CDLL:
    array, count, buffer = ctypes.c_void_p, ctypes.c_int64, ctypes.POINTER(Buffer)
    kinds: dict[str, tuple[Any, ...]] = {
        "occluder_native_draw": (
            buffer, array, count, array, count, array, count, array, count, array,
        ),
        "occluder_native_draw_placed": (
            buffer, array, count, array, count, array, count, array, array,
        ),
        "occluder_native_test": (buffer, array, count, array),
        "occluder_native_tree_bytes": (),
        "occluder_native_open": (array, count, array, array),
        "occluder_native_cull": (
            buffer, array, array, ctypes.c_double, count, array, array, array,
        ),
    }  # fmt: skip
    for name, arguments in kinds.items():
        function = getattr(found, name)
        function.argtypes, function.restype = arguments, ctypes.c_int64
    return found
