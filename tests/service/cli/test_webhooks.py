"""``occluder webhooks`` on a folder that a service may be using."""

from __future__ import annotations

import re
import time

import pytest

from service.jobs.deliveries import DeliveryAttempt, DeliveryState
from service.storage.delivery_store import SqlDeliveryStore
from service.storage.job_store import SqlJobStore
from service.storage.secret_ages import SqlSecretAges
from service.storage.sqlite import SqliteDatabase
from service.webhooks.rotation import CurrentSecrets
from service.webhooks.tenant_secrets import TenantSecrets
from tests.service.storage.samples import submission

REFUSED = DeliveryAttempt(1_700_000_000.0, 41.5, 500, "the receiver answered 500", "no such hook")


@pytest.fixture
def database(here, tmp_path):
    """That of a folder with one key, as a service has it open."""
    here("keys", "create", "--tenant", "studio")
    database = SqliteDatabase.open(tmp_path / "occluder_data" / "occluder.db")
    yield database
    database.close()


def test_a_webhook_is_listed_and_sent_again(here, database):
    assert "there are no such webhooks" in here("webhooks", "list").stderr
    jobs, deliveries = SqlJobStore(database), SqlDeliveryStore(database)
    job, _ = jobs.submit(submission(webhook="https://ci.example.org/hooks/of-team-7f3a"), 10)
    jobs.cancel("studio", job.id)
    (one,) = deliveries.due(10)
    deliveries.give_up(one, REFUSED)

    listed = here("webhooks", "list", "--state", "given_up", "--tenant", "studio")
    head, row = listed.stdout.splitlines()
    assert head.split()[:3] == ["id", "tenant", "state"]
    assert re.fullmatch(
        rf"{one.id} +studio +given_up +1 +2023-11-14 22:13 +42 +500 +https://ci.example.org +"
        r"the receiver answered 500",
        row,
    )
    assert "of-team-7f3a" not in listed.stdout  # which may let others in there

    sent = here("webhooks", "redeliver", one.id)
    assert (sent.returncode, sent.stdout) == (0, "")
    assert [again.id for again in deliveries.due(10)] == [one.id]
    assert deliveries.record(None, one.id).state is DeliveryState.WAITING

    unknown = here("webhooks", "redeliver", "none")
    assert unknown.returncode == 1
    assert "there is no delivery 'none'" in unknown.stderr


def test_a_secret_is_rotated_for_one_tenant_with_an_overlap(here, database, tmp_path):
    master = TenantSecrets.open(tmp_path / "occluder_data")
    current = CurrentSecrets(master, SqlSecretAges(database))
    (before,), (local,) = current.of("studio"), current.of("local")

    rotated = here("webhooks", "rotate-secret", "--tenant", "studio", "--overlap-hours", "2")
    assert rotated.returncode == 0, rotated.stderr
    new = rotated.stdout.strip()
    assert current.of("studio") == (new, before)
    assert current.of("local") == (local,)
    assert here("keys", "secret", "--tenant", "studio").stdout.strip() == new
    later = CurrentSecrets(master, SqlSecretAges(database), lambda: time.time() + 7200.0)
    assert later.of("studio") == (new,)

    leaked = here("webhooks", "rotate-secret", "--tenant", "studio", "--overlap-hours", "0")
    assert "the one before is good no more" in leaked.stderr
    assert current.of("studio") == (leaked.stdout.strip(),)

    slip = here("webhooks", "rotate-secret", "--tenant", "stduio")
    assert (slip.returncode, slip.stdout) == (2, "")
    assert "choose one of local, studio" in slip.stderr
