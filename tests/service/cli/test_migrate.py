"""``occluder migrate``, and a server on a database that others may share, by real processes."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import httpx
import pytest

from simplifier import __version__
from tests.faults.serving import LIGHT_WORK, SURROUNDINGS
from tests.postgres import PostgresServer
from tests.service.real import BOX, QUICK, running
from tests.waiting import until


@pytest.fixture
def shared(postgres: PostgresServer, tmp_path) -> Iterator[dict[str, str]]:
    """Settings of a server on an empty database."""
    address = postgres.empty_database()
    secret = tmp_path / "secret"
    secret.write_bytes(os.urandom(32))
    secret.chmod(0o600)
    yield {"OCCLUDER_DATABASE_URL": address, "OCCLUDER_SECRET_FILE": str(secret)}
    postgres.drop(address)


def test_a_database_is_migrated_and_keys_are_made_in_it(here, shared, tmp_path):
    made = here("keys", "create", **shared)
    assert made.returncode == 2
    assert "run 'occluder migrate' once" in made.stderr

    first, again = (here("migrate", **shared) for _ in range(2))
    assert (first.returncode, again.returncode) == (0, 0), first.stderr
    assert "was empty, and has schema" in first.stderr
    assert "already" in again.stderr

    made = here("keys", "create", "--tenant", "studio", **shared)
    assert made.returncode == 0, made.stderr
    assert "studio" in here("keys", "list", **shared).stdout
    shown = here("keys", "secret", "--tenant", "studio", **shared)
    assert shown.stdout.startswith("whsec_")
    assert not (tmp_path / "occluder_data").exists()
    # Who names a folder means that one.
    assert here("keys", "list", "--data", "elsewhere", **shared).returncode == 2


def test_a_folder_of_its_own_is_migrated_too(here, tmp_path):
    done = here("migrate")
    assert done.returncode == 0
    assert f"release {__version__}" in done.stderr
    assert (tmp_path / "occluder_data" / "occluder.db").exists()


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"OCCLUDER_SECRET_FILE": None}, "one secret"),
        ({"OCCLUDER_SECRET_FILE": "nowhere"}, "cannot be read"),
        ({"OCCLUDER_DATABASE_URL": "mysql://x/y"}, "postgresql://USER"),
        ({"OCCLUDER_DATABASE_URL": None, "OCCLUDER_ENGINE": "none"}, "OCCLUDER_DATABASE_URL"),
    ],
)
def test_what_lacks_or_will_not_do_is_a_line_and_status_2(here, shared, changes, told):
    assert here("migrate", **shared).returncode == 0
    begun = time.monotonic()
    given = {name: value for name, value in (shared | changes).items() if value is not None}
    refused = here("serve", "--port", "0", **given)
    assert refused.returncode == 2, refused.stderr
    (line,) = refused.stderr.splitlines()
    assert told in line
    assert time.monotonic() - begun < 15.0


def test_another_secret_than_that_of_others_is_refused(here, shared, declared, tmp_path):
    assert here("migrate", **shared).returncode == 0
    other = tmp_path / "other secret"
    other.write_bytes(os.urandom(32))
    other.chmod(0o600)
    wrong = shared | {"OCCLUDER_SECRET_FILE": str(other)}
    refused = here("serve", "--port", "0", **wrong)
    assert (refused.returncode, "another secret" in refused.stderr) == (2, True), refused.stderr
    assert here("migrate", **wrong).returncode == 0
    with running(
        declared,
        tmp_path / "occluder_data",
        OCCLUDER_ENGINE="none",
        OCCLUDER_DASHBOARD="false",
        **wrong,
    ):
        pass


def test_a_job_is_done_through_the_shared_database(here, shared, declared, tmp_path, postgres):
    assert here("migrate", **shared).returncode == 0
    path = os.pathsep.join([str(SURROUNDINGS), declared])
    light = {"FAULTS_WORK": str(LIGHT_WORK), "OCCLUDER_DASHBOARD": "false"}
    with (
        running(path, tmp_path / "data", **shared, **light) as server,
        httpx.Client(base_url=server.address, timeout=120.0) as http,
    ):
        asked = {**QUICK, "filename": "box.obj", "asset": "box"}
        done = http.post("/v1/occluders", params=asked, content=BOX, headers={"Prefer": "wait=60"})
        assert done.json()["job"]["state"] == "succeeded", done.text
        assert http.get("/v1/assets").json()["items"][0]["name"] == "box"
        metrics = http.get("/metrics").text
        assert 'occluder_jobs_ended_total{kind="occluder",state="succeeded"} 1.0' in metrics
        assert until(lambda: http.get("/readyz").status_code == 200)

        name = shared["OCCLUDER_DATABASE_URL"].rpartition("/")[2]
        postgres.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS false")
        postgres.execute(
            f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"
        )
        until(lambda: http.get("/readyz").status_code == 503)
        assert "database" in http.get("/readyz").text
        assert http.get("/v1/assets").status_code == 503
        postgres.execute(f"ALTER DATABASE {name} ALLOW_CONNECTIONS true")
        until(lambda: http.get("/readyz").status_code == 200)
        assert http.get("/v1/assets").status_code == 200
