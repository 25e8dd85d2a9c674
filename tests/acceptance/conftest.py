"""The command line in this process; slow tests run only when asked for: ``make test-slow``."""

from __future__ import annotations

import os
import sys

import pytest

from simplifier import cli


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: takes minutes; run by `make test-slow`")


def pytest_collection_modifyitems(config, items):
    if "slow" in config.getoption("markexpr"):
        return
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.skip(reason="takes minutes; `make test-slow` runs it"))


@pytest.fixture
def command(monkeypatch, capfd):
    """``command("simplify", …)``: exit status, standard output, standard error."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["occluder", *map(os.fspath, arguments)])
        with pytest.raises(SystemExit) as end:
            cli.main()
        shown = capfd.readouterr()
        return end.value.code or 0, shown.out, shown.err

    return run
