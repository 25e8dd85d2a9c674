"""``occluder build --server`` with more assets than may be under way at a service."""

from __future__ import annotations

import os
import signal
import subprocess
import time

import pytest

from service.client import Client
from service.jobs.job import JobState, Priority
from tests.acceptance.command import OCCLUDER, ROOT, environment
from tests.service.declared import declare
from tests.service.real import BOX, QUICK, running
from tests.waiting import until

UNDER_WAY = 256
MANIFEST = '[[asset]]\nfiles = "*.obj"\nresolution = 8\nmoves = 0\nviews = 4\nimage = 32\n'


@pytest.mark.slow
def test_256_wait_at_a_service_and_ctrl_c_takes_them_back(tmp_path_factory):
    """The only worker is busy with something else, so that all wait."""
    declared = os.pathsep.join([str(declare(tmp_path_factory.mktemp("declared"))), str(ROOT)])
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "occluders.toml").write_text(MANIFEST)
    for i in range(UNDER_WAY + 40):
        (folder / f"m{i}.obj").write_bytes(BOX + f"# {i}\n".encode())
    served = running(declared, tmp_path_factory.mktemp("served") / "data")
    with served as server, Client(server.address) as client:
        endless = {**QUICK, "budget": 11, "moves": 100_000_000}  # one triangle fewer than the box
        busy = client.submit(BOX, name="box.obj", options=endless)
        build = subprocess.Popen(
            [*OCCLUDER, "build", "--server", server.address], cwd=folder, text=True,
            env=environment(PYTHONPATH=declared), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
        )  # fmt: skip
        with build:
            until(lambda: time.sleep(0.2) or waiting(client) >= UNDER_WAY or build.poll(), 60.0)
            time.sleep(0.3)  # in which one too many would come
            assert waiting(client) == UNDER_WAY
            build.send_signal(signal.SIGINT)
            _, errors = build.communicate(timeout=30)
        assert build.returncode == 130
        assert "interrupted; what was made is kept" in errors
        assert waiting(client) == 0
        taken_back = list(client.jobs(states=[JobState.CANCELLED]))
        assert len(taken_back) == UNDER_WAY
        assert {one.priority for one in taken_back} == {Priority.BULK}
        assert client.job(busy.id).state is JobState.RUNNING
        client.cancel(busy.id)


def waiting(client):
    return sum(1 for one in client.jobs(states=[JobState.QUEUED]) if one.priority is Priority.BULK)
