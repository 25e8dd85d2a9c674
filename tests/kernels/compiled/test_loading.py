"""Files of machine code: what is damaged is refused before the linker sees it."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from simplifier.kernels.compiled.code_files import find_code
from simplifier.kernels.compiled.loading import load_code, packed
from simplifier.kernels.compiled.waiting import load_imported
from simplifier.kernels.ears import clip_ears
from simplifier.kernels.loops import trace_loops


@pytest.fixture
def ears():
    load_imported()
    return find_code("ears")


def test_functions_take_and_return_what_kernels_do(ears):
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    faces = [np.zeros((2, 3), np.int64) for _ in range(2)]
    counts = [load_code(ears, ["clip_ears"])["clip_ears"](square, np.arange(4), 100, faces[0])]
    counts.append(clip_ears(square, np.arange(4), 100, faces[1]))
    assert counts == [2, 2]
    assert np.array_equal(*faces)


def test_arrays_that_a_kernel_makes_live_on():
    found = [trace_loops(np.ones((3, 3), np.bool_), np.zeros(2), 1.0) for _ in range(50)]
    arrays = [part for one in found for part in one if isinstance(part, np.ndarray)]
    assert arrays
    assert len({array.tobytes() for array in arrays}) == len(arrays) // 50


_UNLOADED = """
import ctypes, gc, sys
import numpy as np
from simplifier.kernels.loops import trace_loops

arguments = np.ones((3, 3), np.bool_), np.zeros(2), 1.0
before = trace_loops(*arguments)[0]
trace = trace_loops._run
del trace_loops
for name in [name for name in sys.modules if name.startswith("simplifier")]:
    del sys.modules[name]
gc.collect()
others = [ctypes.CFUNCTYPE(ctypes.c_int)(lambda: 0) for _ in range(1000)]
assert np.array_equal(trace(*arguments)[0], before)
"""


def test_a_kernel_outlives_the_modules_that_loaded_it():
    """It ended the process: what it calls for the types of its arrays was gone."""
    subprocess.run([sys.executable, "-c", _UNLOADED], check=True)


_SCATTERED = """
import ctypes, sys

libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, *[ctypes.c_size_t] * 5]
libc.munmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t]

def reserved(size):
    private, anonymous, without_memory = 2, 0x20, 0x4000
    flags = private | anonymous | without_memory
    place = libc.mmap(None, size, 0, flags, ctypes.c_size_t(-1).value, 0)
    assert place != ctypes.c_void_p(-1).value
    return place

import numpy as np
from simplifier.kernels import annealing, coverage, ears, room

for size in (1 << power for power in range(26, 11, -2)):
    for _ in range(64):
        reserved(size)
for _ in range(256):
    reserved(8 << 30)
    hole = int(sys.argv[1])
    libc.munmap(reserved(hole), hole)
reserved(8 << 30)

square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
call = ears.clip_ears if sys.argv[2] == "kept" else ears.clip_ears.compiled_by_numba
print(call(square, np.arange(4), 100, np.zeros((2, 3), np.int64)))
from simplifier.kernels.compiled.library import load_all
if sys.argv[2] == "kept":
    load_all()
"""
"""What the driver of a graphics card does to the addresses of a process, in small."""


@pytest.mark.skipif(sys.platform != "linux", reason="reserves addresses as Linux does")
@pytest.mark.parametrize("code", ["kept", "compiled"])
@pytest.mark.parametrize("hole", [0x4000, 0x10000])
def test_code_is_loaded_where_free_addresses_are_far_apart(code, hole, ears):
    """Beside the driver of an H200 the linker put constants more than 2 GiB from what reads them,
    and ended the process."""
    command = [sys.executable, "-c", _SCATTERED, str(hole), code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "2\n"), done.stderr


@pytest.mark.parametrize("place", [-1, 200, 5000])
def test_a_damaged_file_is_refused(ears, tmp_path, place):
    data = bytearray(ears.read_bytes())
    data[place] ^= 1
    path = tmp_path / ears.name
    path.write_bytes(data)
    with pytest.raises(ValueError, match="is damaged; remove it"):
        load_code(path, ["clip_ears"])


def test_a_file_that_is_cut_short_is_refused(ears, tmp_path):
    path = tmp_path / ears.name
    path.write_bytes(ears.read_bytes()[:-100])
    with pytest.raises(ValueError, match="damaged"):
        load_code(path, ["clip_ears"])
    path.write_bytes(b"")
    with pytest.raises(ValueError):
        load_code(path, ["clip_ears"])
    path.write_bytes(packed(b"no object file", {})[:-1])
    with pytest.raises(ValueError, match="damaged"):
        load_code(path, ["clip_ears"])
