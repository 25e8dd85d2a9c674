"""Kernels that are compiled ahead, in other processes, and what happens where that fails."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

from simplifier.kernels.compiled.library import BuildError, build
from simplifier.kernels.compiled.processors import Processor
from simplifier.kernels.compiled.waiting import load_imported
from tests.acceptance.command import environment

FEW = """
import numpy as np
from simplifier.kernels.compiled import library
from simplifier.kernels.ears import clip_ears

def ears():
    faces = np.zeros((2, 3), np.int64)
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return clip_ears(square, np.arange(4), 100, faces), faces.tolist()
"""
BROKEN = """library._BUILD = "raise SystemExit('no compiler here')" """


def run(code, folder, **variables):
    """In a fresh process with an empty folder for machine code; what it printed and logged."""
    return subprocess.run(
        [sys.executable, "-c", FEW + code], text=True, capture_output=True, timeout=300, check=True,
        env=environment(NUMBA_CACHE_DIR=str(folder), **variables),
    )  # fmt: skip


@pytest.mark.slow
def test_the_first_call_compiles_once_and_shows_it(tmp_path):
    shown = """
from contextlib import contextmanager
from simplifier.progress import show_compiling_by

@contextmanager
def show():
    yield lambda done, total: print("compiling", done, total)

show_compiling_by(show)
print(*ears(), sep=";")
import sys
print("numba" in sys.modules)
"""
    first, second = (run(shown, tmp_path).stdout.splitlines() for _ in range(2))
    faces = second[0]
    assert first == ["compiling 0 1", "compiling 1 1", faces, "False"]
    assert second == [faces, "False"]
    (code,) = tmp_path.glob("*.o")
    assert code.name.startswith("ears.")
    # Where it cannot be compiled ahead, numba compiles it: the same results, and a word about it.
    done = run(f"{BROKEN}\nprint(*ears(), sep=';')", tmp_path / "other")
    assert done.stdout.splitlines() == [faces]
    assert done.stderr == (
        "kernels are compiled one by one, which takes longer: ears: no compiler here\n"
    )
    assert not list((tmp_path / "other").glob("*.o"))
    # A damaged file is no end either.
    code.write_bytes(code.read_bytes()[:-1])
    done = run("print(*ears(), sep=';')", tmp_path)
    assert done.stdout.splitlines() == [faces]
    assert "is damaged; remove it" in done.stderr


def test_a_compiler_that_fails_is_told(tmp_path, monkeypatch):
    load_imported()
    monkeypatch.setattr("simplifier.kernels.compiled.library._BUILD", "import sys; sys.exit('why')")
    told = []
    with pytest.raises(BuildError, match="ears: why"):
        build(["ears"], lambda done, total: told.append((done, total)), tmp_path, Processor.own())
    assert told == [(0, 1)]


def test_what_the_listener_raises_ends_the_compilers(tmp_path, monkeypatch):
    endless = "import time\nwhile True: time.sleep(60)"
    monkeypatch.setattr("simplifier.kernels.compiled.library._BUILD", endless)

    def tell(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build(["ears", "ply"], tell, tmp_path, Processor.own())


@pytest.mark.skipif(platform.machine() != "x86_64", reason="names a processor of that kind")
@pytest.mark.slow
def test_code_for_any_processor_of_a_kind_gives_the_same(tmp_path):
    found = [
        run("print(*ears(), sep=';')", tmp_path, NUMBA_CPU_NAME=name, NUMBA_CPU_FEATURES="").stdout
        for name in ("", "x86-64-v2", "x86-64-v2")
    ]
    assert len(set(found)) == 1
    kinds = sorted(".x86-64-v2-" in path.name for path in tmp_path.glob("*.o"))
    assert kinds == [False, True]
