"""What the servers and workers of a cluster are started with."""

from __future__ import annotations

import pytest

from tests.cluster.machines import Cluster
from tests.faults.serving import LIGHT_WORK, path_of_processes


@pytest.fixture(scope="session")
def declared(tmp_path_factory):
    """What goes on the path of all processes."""
    return path_of_processes(tmp_path_factory.mktemp("declared"))


@pytest.fixture
def cluster(declared, tmp_path):
    """``cluster(hosts=3)``: a running one; ``work=None`` lets the library do its jobs."""
    made = []

    def make(*, work=LIGHT_WORK, **more):
        if work is not None:
            more["FAULTS_WORK"] = str(work)
        made.append(Cluster(declared, tmp_path, **more))
        return made[-1]

    yield make
    for one in made:
        one.close()
