"""The command line in this process, quick enough for many cases."""

from __future__ import annotations

from functools import partial

import pytest

from tests.acceptance.command import occluder_here


@pytest.fixture
def here(monkeypatch, capfd):
    """``here("simplify", …)``: as ``occluder`` of ``tests.acceptance.command``."""
    return partial(occluder_here, monkeypatch, capfd)


@pytest.fixture
def command(here):
    """``command("simplify", …)``: exit status, standard output, standard error."""

    def run(*arguments):
        done = here(*arguments)
        return done.returncode, done.stdout, done.stderr

    return run
