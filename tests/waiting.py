"""Waiting for what another thread or process does."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

Found = TypeVar("Found")

BUSY = 60.0
"""Seconds in which a server answers on a machine that has other tests to run."""


def until(condition: Callable[[], Found], seconds: float = 30.0) -> Found:
    """What the condition gives once that is true; fails where it never is."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, f"not so within {seconds:g} s"
        time.sleep(0.005)
    return found
