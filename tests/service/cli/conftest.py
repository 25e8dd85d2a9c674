"""The command line with the service's commands, in a process of its own or in this one."""

from __future__ import annotations

import os

import pytest

from tests.acceptance.command import ROOT, occluder, occluder_here
from tests.service.declared import declare


@pytest.fixture(scope="session")
def declared(tmp_path_factory):
    """What goes on the path, so that ``occluder`` finds the service's commands."""
    return os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])


@pytest.fixture
def command(declared, tmp_path):
    """``command("submit", …)``: the finished process; variables are given by name."""

    def run(*arguments, **variables):
        settings = {name: None for name in os.environ if name.startswith("OCCLUDER_")}
        return occluder(
            *arguments, cwd=tmp_path, **{**settings, "PYTHONPATH": declared, **variables}
        )

    return run


@pytest.fixture
def here(declared, tmp_path, monkeypatch, capfd):
    """The same without a process of its own, whose start takes a second of the processor."""
    for folder in reversed(declared.split(os.pathsep)):
        monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(tmp_path)

    def run(*arguments, **variables):
        for name in os.environ:
            if name.startswith("OCCLUDER_"):
                monkeypatch.delenv(name)
        for name, value in variables.items():
            monkeypatch.setenv(name, os.fspath(value))
        return occluder_here(monkeypatch, capfd, *arguments)

    return run
