"""Limits of control groups, as containers of both versions show them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from simplifier.memory.limit import machine_memory


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="by what Linux tells")
def test_the_machine_has_no_more_than_is_built_in():
    lines = Path("/proc/meminfo").read_text().splitlines()
    assert 0 < machine_memory() <= int(lines[0].split()[1]) * 1024
