"""Light work for the workers of a service that runs in this process."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.faults.serving import LIGHT_WORK, SURROUNDINGS


@contextmanager
def light_workers() -> Iterator[None]:
    """Those that are started within the block do what the first line of a mesh says.

    A worker finds modules where this process does, and what it is to load there as well.
    """
    with pytest.MonkeyPatch.context() as patch:
        path = [str(SURROUNDINGS), *sys.path, f"/faults/FAULTS_WORK={LIGHT_WORK}"]
        patch.setattr(sys, "path", path)
        yield
