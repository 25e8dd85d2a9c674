"""The command line in this process, quick enough for many cases."""

from __future__ import annotations

import pytest

from simplifier.processes import run_jobs_here
from tests.acceptance.command import draw_small


@pytest.fixture
def command(here):
    """``command("simplify", …)``: exit status, standard output, standard error."""

    def run(*arguments):
        done = here(*arguments)
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.fixture
def making_here(monkeypatch):
    """Builds make their assets in this process: each that they start takes most of a second."""

    def made(start, arguments, jobs, processes, cancel):
        with monkeypatch.context() as patch:
            patch.setenv("OCCLUDER_THREADS", "1")  # is set anew, and afterwards as it was
            yield from run_jobs_here(start(*arguments), jobs, 1, cancel)

    monkeypatch.setattr("simplifier.builds.build.run_jobs", made)


@pytest.fixture
def small_pictures(monkeypatch):
    draw_small(monkeypatch)
