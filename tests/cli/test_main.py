"""The process of the command: how it begins and ends."""

from __future__ import annotations

import subprocess
import sys

import pytest

from simplifier.matrix_threads import ONE_THREAD
from tests.acceptance.command import environment

LOOKS = """
import atexit, gc, os
atexit.register(lambda: print("said:", gc.get_freeze_count(), os.environ["OPENBLAS_NUM_THREADS"]))
from simplifier.cli.main import main
main()
"""


def said_at_the_end(**changes: str | None) -> list[int]:
    command = [sys.executable, "-P", "-c", LOOKS, "--version"]
    done = subprocess.run(
        command, env=environment(**changes), capture_output=True, text=True, check=True, timeout=60
    )
    return [int(number) for number in done.stdout.split("said:")[1].split()]


def test_nothing_is_looked_through_as_a_process_ends() -> None:
    """Python would look for garbage among all that was loaded, of which none is."""
    spared, _ = said_at_the_end()
    assert spared > 10_000


@pytest.mark.parametrize(("chosen", "threads"), [(None, 1), ("3", 3)])
def test_matrices_have_one_thread_unless_more_are_asked_for(
    chosen: str | None, threads: int
) -> None:
    """Others would only keep processors from the kernels."""
    _, found = said_at_the_end(**dict.fromkeys(ONE_THREAD, chosen))
    assert found == threads
