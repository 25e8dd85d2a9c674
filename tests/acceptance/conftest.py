"""The command line in this process, quick enough for many cases."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from simplifier.cli.main import main


@pytest.fixture
def command(monkeypatch, capfd):
    """``command("simplify", …)``: exit status, standard output, standard error."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["occluder", *map(os.fspath, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        shown = capfd.readouterr()
        return end.value.code or 0, shown.out, shown.err

    return run


@pytest.fixture
def here(command, monkeypatch):
    """What ``occluder`` of ``tests.acceptance.command`` tells, without the second of a start."""

    def run(*arguments, cwd=None):
        if cwd is not None:
            monkeypatch.chdir(cwd)
        return subprocess.CompletedProcess(arguments, *command(*arguments))

    return run
