"""Pages that were freed are used again."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

from tests.acceptance.command import environment

TWICE = """
import resource, sys
import numpy as np
from simplifier.cli.allocator import keep_freed_memory

heard = keep_freed_memory() if sys.argv[1] == "kept" else None
np.ones(3 << 20).sum()  # 24 MiB
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
np.ones(3 << 20).sum()
print(heard, resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries decide themselves")
def test_what_was_freed_needs_no_new_pages() -> None:
    def new_pages(how: str) -> tuple[str, int]:
        done = subprocess.run(
            [sys.executable, "-P", "-c", TWICE, how], env=environment(MALLOC_MMAP_THRESHOLD_=None),
            capture_output=True, text=True, check=True, timeout=60,
        )  # fmt: skip
        heard, pages = done.stdout.split()
        return heard, int(pages)

    _, usual = new_pages("given back")
    heard, pages = new_pages("kept")
    assert heard == "True"
    assert 5 * pages < usual
