"""What the servers and workers of a cluster are started with."""

from __future__ import annotations

import os

import pytest

from tests.acceptance.command import ROOT
from tests.cluster.machines import Cluster
from tests.faults.serving import LIGHT_WORK, SURROUNDINGS
from tests.service.declared import declare


@pytest.fixture(scope="session")
def declared(tmp_path_factory):
    """What goes on the path of all processes."""
    record = declare(tmp_path_factory.mktemp("declared"))
    return os.pathsep.join(map(str, [SURROUNDINGS, record, ROOT]))


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
