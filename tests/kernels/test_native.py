"""The compiled headers fill a buffer and judge boxes bit by bit as numba's kernels do."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simplifier.culling.depth_buffer import DepthBuffer
from simplifier.kernels import native
from simplifier.kernels.depth_buffer import STALE
from tests.acceptance.command import environment
from tests.rasters import random_camera

has_library = pytest.mark.skipif(native.library() is None, reason="there is no C compiler here")


def buffers(rows, columns, coverage):
    """Two that draw by numba and by the headers."""
    plain, compiled = (DepthBuffer(rows, columns, coverage) for _ in range(2))
    plain.native = None
    return plain, compiled


@has_library
@pytest.mark.parametrize("coverage", ["centre", "inner"])
@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_both_give_the_same_bits(coverage, seed):
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(1, 120, 2).tolist()
    camera = random_camera(rng)
    plain, compiled = buffers(rows, columns, coverage)
    assert compiled.native is not None
    for _ in range(3):
        scale = rng.choice([0.02, 1.0, 6.0, 300.0])
        spread, count = rng.choice([0.1, 1.0, 3.0]), int(rng.integers(1, 40))
        vertices = camera.position + spread * rng.normal(size=(12, 3)) * scale
        vertices += scale * rng.uniform(0.0, 3.0) * camera.axes[2]
        faces = rng.integers(0, 12, (count, 3)).astype(np.int32)
        error = rng.choice([0.0, 0.3 * scale, np.inf]) if rng.random() < 0.7 else None
        each = rng.choice([0.0, 0.1, 2.0, np.inf], count) if error is None else error
        for buffer in (plain, compiled):
            buffer.draw_mesh(vertices, faces, camera, each)
        np.testing.assert_array_equal(plain.depth, compiled.depth)
        np.testing.assert_array_equal(plain.tiles, compiled.tiles)
    middles = camera.position + rng.normal(size=(80, 3)) * rng.choice([1.0, 6.0, 400.0], (80, 1))
    halves = rng.uniform(0.0, 1.0, (80, 3)) ** 3 * rng.choice([0.2, 3.0, 50.0], (80, 1))
    boxes = np.stack([middles - halves, middles + halves], axis=1)
    boxes[0, 1, 2], boxes[1, 0, 0] = np.nan, np.inf
    np.testing.assert_array_equal(plain.test(boxes, camera), compiled.test(boxes, camera))
    # The headers settle some boxes without a look at stale tiles.
    both = (plain.tiles[STALE] == 0.0) & (compiled.tiles[STALE] == 0.0)
    np.testing.assert_array_equal(plain.tiles[:STALE, both], compiled.tiles[:STALE, both])


def run(code, **more):
    return subprocess.run(
        [sys.executable, "-c", code], env=environment(**more), capture_output=True, text=True,
        timeout=120, check=True,
    ).stdout.strip()  # fmt: skip


ASKED = """
from simplifier.kernels.native import library
print(library() is not None)
"""


@has_library
def test_what_was_compiled_is_kept_and_found_without_a_compiler_to_run(tmp_path):
    """It is made once for each of what it hangs on, in the folder that numba is given."""
    counting = tmp_path / "counting"
    counting.write_text('#!/bin/sh\necho called >> "$0.log"\nexec cc "$@"\n')
    counting.chmod(0o700)
    given = {"NUMBA_CACHE_DIR": str(tmp_path / "kept"), "CC": str(counting)}
    assert [run(ASKED, **given) for _ in range(2)] == ["True", "True"]
    made = list((tmp_path / "kept").rglob("*"))
    assert [one.suffix for one in made] == [".so"]
    calls = (tmp_path / "counting.log").read_text().count("called")
    assert calls == 1


@pytest.mark.parametrize(
    "given",
    [{"CC": "false"}, {"CC": "no-such-compiler"}, {"OCCLUDER_NATIVE": "off"},
     {"NUMBA_DISABLE_JIT": "1"}],
)  # fmt: skip
def test_without_a_compiler_there_is_no_library_and_nothing_is_left_behind(tmp_path, given):
    assert run(ASKED, NUMBA_CACHE_DIR=str(tmp_path), **given) == "False"
    assert list(tmp_path.rglob("*.so")) == []
    assert list(tmp_path.glob("native*")) == []
