"""For which processors the image's kernels are compiled."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path

import pytest

from tests.acceptance.command import ROOT

_NAMES = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES")
_V3 = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}


def chosen(**variables):
    """The two variables after the script, as the environment of what it starts; None if unset."""
    script = ". docker/processor.sh; exec env"
    kept = {name: value for name, value in os.environ.items() if name not in _NAMES}
    done = subprocess.run(
        ["sh", "-euc", script], cwd=ROOT, env={**kept, **variables}, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    told = dict(line.split("=", 1) for line in done.stdout.splitlines() if "=" in line)
    return tuple(told.get(name) for name in _NAMES)


def is_of_the_kind():
    cpuinfo = Path("/proc/cpuinfo")
    if platform.machine() != "x86_64" or not cpuinfo.exists():
        return False
    line = next(line for line in cpuinfo.read_text().splitlines() if line.startswith("flags"))
    return set(line.split()) >= _V3


def test_most_processors_run_what_the_image_holds():
    assert chosen() == (("x86-64-v3", "") if is_of_the_kind() else (None, None))


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"NUMBA_CPU_NAME": "znver3", "NUMBA_CPU_FEATURES": "+avx2"}, ("znver3", "+avx2")),
        ({"NUMBA_CPU_NAME": "", "NUMBA_CPU_FEATURES": ""}, (None, None)),
        ({"NUMBA_CPU_NAME": ""}, (None, None)),
    ],
)
def test_whoever_says_otherwise_is_obeyed(given, found):
    assert chosen(**given) == found
