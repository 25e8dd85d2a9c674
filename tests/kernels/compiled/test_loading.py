"""Files of machine code: what is damaged is refused before the linker sees it."""

from __future__ import annotations

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
    counts = [load_code(ears, ["clip_ears"])["clip_ears"](square, 100, faces[0])]
    counts.append(clip_ears(square, 100, faces[1]))
    assert counts == [2, 2]
    assert np.array_equal(*faces)


def test_arrays_that_a_kernel_makes_live_on():
    found = [trace_loops(np.ones((3, 3), np.bool_), np.zeros(2), 1.0) for _ in range(50)]
    arrays = [part for one in found for part in one if isinstance(part, np.ndarray)]
    assert arrays
    assert len({array.tobytes() for array in arrays}) == len(arrays) // 50


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
