"""Tests of what is written in LLVM's instructions, once more for kinds of processors that this one
is of and does not choose: vectors have other lengths there, and other instructions."""

from __future__ import annotations

import subprocess
import sys

import pytest

from simplifier.kernels.compiled.processors import Kind, Processor, kinds_here
from tests.acceptance.command import ROOT, environment

FILES = ("test_faces.py", "test_contours_machine.py", "test_soup_views_machine.py")
# As on ARM, nothing moves bytes within a register here unless it is told that it can.
PLAIN = Kind("nehalem", Processor("nehalem"), frozenset({"sse4.2"}))
ITSELF = Kind("itself", Processor.own(), frozenset())
OTHERS = [
    kind
    for kind in (PLAIN, ITSELF, *kinds_here())
    if kind.runs_here() and kind.processor != Processor.chosen()
]


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize(
    "kind",
    # The last one is what most machines are of.
    [pytest.param(one, marks=[] if one is OTHERS[-1] else pytest.mark.slow) for one in OTHERS],
    ids=lambda kind: kind.name,
)
def test_it_does_the_same_on_another_kind(kind, name, tmp_path):
    """Some ten seconds of compiling: each file apart, so that no kernels of the others are."""
    variables = environment(**kind.processor.variables, NUMBA_CACHE_DIR=str(tmp_path))
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-n", "0"]
    done = subprocess.run(
        [*command, f"tests/kernels/{name}"],
        cwd=ROOT, env=variables, text=True, capture_output=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout
