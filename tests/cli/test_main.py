"""The process of the command: how it begins and ends."""

from __future__ import annotations

import subprocess
import sys

from tests.acceptance.command import environment

LOOKS = """
import atexit, gc
atexit.register(lambda: print("spared:", gc.get_freeze_count()))
from simplifier.cli.main import main
main()
"""


def test_nothing_is_looked_through_as_a_process_ends():
    """Python would look for garbage twice among all that was loaded, which is none."""
    command = [sys.executable, "-P", "-c", LOOKS, "--version"]
    done = subprocess.run(
        command, env=environment(), capture_output=True, text=True, check=True, timeout=60
    )
    said, spared = done.stdout.split("spared: ")
    assert said.strip()
    assert int(spared) > 10_000
