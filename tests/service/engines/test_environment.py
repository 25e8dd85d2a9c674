"""What worker processes are given of the server's environment."""

from __future__ import annotations

import json

import pytest

from service.engines.environment import worker_environment
from service.jobs.job import JobState
from tests.service.engines.workplace import Workplace

SECRETS = {
    "OCCLUDER_DATABASE_URL": "postgresql://me:word@host/jobs",
    "OCCLUDER_SECRET_FILE": "/run/secrets/occluder",
    "AWS_SECRET_ACCESS_KEY": "key",
    "AWS_SESSION_TOKEN": "token",
    "PGPASSWORD": "word",
    "OTEL_EXPORTER_OTLP_HEADERS": "authorization=token",
    "HTTPS_PROXY": "http://me:word@proxy:3128",
    "no_proxy": "localhost",
    "SSH_AUTH_SOCK": "/tmp/agent",
    "PYTHONSTARTUP": "/home/me/start.py",
    "PYTHONPATH": "/home/me",
}
NEEDED = {
    "PATH": "/bin", "HOME": "/home/me", "TMPDIR": "/tmp", "LC_ALL": "C.UTF-8",
    "NUMBA_CACHE_DIR": "/data/kernels", "MPLCONFIGDIR": "/data/matplotlib", "OCCLUDER_LOG": "json",
}  # fmt: skip


@pytest.mark.parametrize("name", SECRETS)
def test_what_is_not_listed_stays_with_the_server(name):
    assert SECRETS[name] not in worker_environment(SECRETS, "/lib").values()


def test_what_is_needed_passes_and_threads_are_set():
    given = worker_environment({**NEEDED, **SECRETS, "OMP_NUM_THREADS": "64"}, "/lib")
    assert given.items() >= NEEDED.items()
    assert (given["PYTHONPATH"], given["OMP_NUM_THREADS"]) == ("/lib", "1")


def test_a_job_sees_no_secret_of_the_server(tmp_path, monkeypatch):
    for name in SECRETS.keys() - {"PYTHONPATH"}:
        monkeypatch.setenv(name, "secret of the server")
    monkeypatch.setenv("LC_TIME", "C")
    place = Workplace(tmp_path / "place", workers=1)
    with place.open():
        job = place.end_of(place.submit("tell_environment"))
    assert job.state is JobState.SUCCEEDED
    told = json.loads(place.results(job.id)["environment.json"])
    assert told["LC_TIME"] == "C"
    assert not [name for name, value in told.items() if "secret" in value]
