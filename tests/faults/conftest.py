"""Servers that meet with faults: real processes in a folder of their own."""

from __future__ import annotations

import pytest

from tests.faults.serving import LIGHT_WORK, Server, path_of_processes


@pytest.fixture(scope="session")
def declared(tmp_path_factory):
    """What goes on the path of a server and its workers."""
    return path_of_processes(tmp_path_factory.mktemp("declared"))


@pytest.fixture
def server(declared, tmp_path):
    """``server(OCCLUDER_WORKERS="2")``: one whose jobs are light, not started yet.

    ``work=None`` lets the library do them.
    """
    servers = []

    def make(*arguments, data=tmp_path / "data", work=LIGHT_WORK, **variables):
        if work is not None:
            variables["FAULTS_WORK"] = str(work)
        # Nobody looks at its pages, which take 0.3 s of processor time to load.
        variables.setdefault("OCCLUDER_DASHBOARD", "false")
        servers.append(Server(declared, data, *arguments, **variables))
        return servers[-1]

    yield make
    for one in servers:
        one.kill()
