"""``occluder keys`` by real processes, on a folder that a service may be using."""

from __future__ import annotations

import sqlite3
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from service.access.key import Scope
from service.storage.key_store import SqlKeyStore
from service.storage.sqlite import SqliteDatabase
from service.webhooks.tenant_secrets import TenantSecrets


@pytest.fixture
def keys(tmp_path):
    """``keys()``: the keys of the folder, as a service that runs would see them."""
    opened = []

    def look():
        if not opened:
            opened.append(SqliteDatabase.open(tmp_path / "occluder_data" / "occluder.db"))
        return SqlKeyStore(opened[0])

    yield look
    for database in opened:
        database.close()


def test_a_key_is_made_listed_and_revoked_while_a_service_uses_the_folder(command, here, tmp_path):
    made = command("keys", "create", "--tenant", "studio", "--scope", "read", "--name", "night")
    assert made.returncode == 0, made.stderr
    secret = made.stdout.strip()
    assert secret.startswith("occ_")
    assert "shown only now" in made.stderr
    assert secret not in made.stderr

    database = SqliteDatabase.open(tmp_path / "occluder_data" / "occluder.db")
    try:
        store = SqlKeyStore(database)
        key = store.find(secret)
        assert (key.tenant, key.name, key.scope) == ("studio", "night", Scope.READ)

        listed = here("keys", "list")
        assert listed.returncode == 0
        head, row = listed.stdout.splitlines()
        assert head.split()[:3] == ["id", "begins", "tenant"]
        assert row.split()[:4] == [key.id, key.hint, "studio", "read"]
        for column, value in (("tenant", "studio"), ("scope", "read"), ("name", "night")):
            assert row[head.index(column) :].startswith(value)
        assert secret not in listed.stdout

        revoked = here("keys", "revoke", key.hint)
        assert revoked.returncode == 0
        assert key.id in revoked.stderr
        assert store.find(secret) is None
    finally:
        database.close()


def test_a_folder_is_made_that_nobody_else_reads_and_that_holds_no_key(here, tmp_path):
    secret = here("keys", "create", "--data", "deep/data").stdout.strip()
    folder = tmp_path / "deep" / "data"
    assert folder.stat().st_mode & 0o077 == 0
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert files
    assert not any(secret.encode() in path.read_bytes() for path in files)


def test_the_secret_of_webhooks_is_what_they_are_signed_with(here, tmp_path):
    here("keys", "create", "--tenant", "studio")
    told = here("keys", "secret", "--tenant", "studio")
    assert told.returncode == 0
    assert told.stdout.strip() == TenantSecrets.open(tmp_path / "occluder_data").of("studio")

    slip = here("keys", "secret", "--tenant", "stduio")
    assert (slip.returncode, slip.stdout) == (2, "")
    assert "choose one of local, studio" in slip.stderr


def test_a_key_ends_at_a_time_or_on_a_date(here, keys):
    begin = time.time()
    made = here("keys", "create", "--expires", "90d")
    assert made.returncode == 0, made.stderr
    assert " until 20" in made.stderr
    key = keys().find(made.stdout.strip())
    assert 90 * 86_400.0 <= key.expires - begin <= 90 * 86_400.0 + 60.0
    here("keys", "create", "--expires", "2999-01-31")
    store = keys()
    dates = [datetime(2999, 1, 31, hour, tzinfo=UTC).timestamp() for hour in (0, 11)]
    here("keys", "create", "--expires", "2999-01-31T12:00+01:00")
    listed = store.keys()
    assert [key.expires for key in listed][1:] == dates
    head, *rows = here("keys", "list").stdout.splitlines()
    assert rows[1][head.index("expires") :].startswith("2999-01-31 00:00")


def test_a_key_is_rotated_and_both_work_for_a_time(here, keys):
    old = here("keys", "create", "--tenant", "studio", "--scope", "read").stdout.strip()
    turned = here("keys", "rotate", old[:8], "--overlap", "24h")
    assert turned.returncode == 0, turned.stderr
    new = turned.stdout.strip()
    assert keys().find(old).tenant == keys().find(new).tenant == "studio"
    day = datetime.fromtimestamp(keys().find(old).revoked, UTC)
    assert f"which ends {day:%Y-%m-%d %H:%M}" in turned.stderr
    assert 0.0 <= time.time() + 86_400.0 - day.timestamp() < 60.0
    again = here("keys", "rotate", old[:8])
    assert again.returncode == 1
    assert keys().find(new).id in again.stderr
    at_once = here("keys", "rotate", new[:8], "--overlap", "0h", "--expires", "1h")
    assert keys().find(new) is None
    assert keys().find(at_once.stdout.strip()).expires < time.time() + 3601.0


def test_the_journal_tells_who_did_what(here, keys):
    secret = here("keys", "create", "--tenant", "studio", "--name", "ci").stdout.strip()
    here("keys", "create", "--tenant", "rival")
    here("keys", "secret", "--tenant", "studio")
    here("keys", "revoke", secret[:8])
    told = here("keys", "journal", "--tenant", "studio")
    assert told.returncode == 0
    head, *rows = told.stdout.splitlines()
    assert head.split() == ["when", "tenant", "who", "from", "what", "of", "more"]
    what = [row.split()[5] for row in rows]
    assert what == ["key-revoked", "webhook-secret-shown", "key-made"]
    assert all(row.split()[2:5] == ["studio", "command-line", "-"] for row in rows)
    assert rows[-1].endswith('{"name": "ci", "scope": "write", "expires": null}')
    assert secret not in told.stdout
    assert len(here("keys", "journal").stdout.splitlines()) == 5
    assert len(here("keys", "journal", "--limit", "1").stdout.splitlines()) == 2
    assert len(here("keys", "journal", "--since", "1h").stdout.splitlines()) == 5
    later = here("keys", "journal", "--since", "2999-01-01")
    assert (later.stdout, later.returncode) == ("", 0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("create", "--expires", "soon"), "expires"),
        (("create", "--expires", "2027-13-01"), "expires"),
        (("create", "--expires", "-1d"), "expires"),
        (("rotate", "occ_Ab3d", "--overlap", "24"), "overlap"),
        (("create", "--tenant", "two words"), "tenant"),
        (("create", "--name", "a\nb"), "name"),
    ],
)
def test_wrong_values_are_refused_in_a_line(here, tmp_path, arguments, words):
    ended = here("keys", *arguments)
    assert (ended.returncode, ended.stdout) == (2, "")
    (line,) = ended.stderr.splitlines()
    assert line.startswith(f"error: {words}: ")
    assert not (tmp_path / "occluder_data").exists()


@pytest.mark.parametrize("arguments", [("list",), ("secret",)])
def test_a_slip_in_the_folders_name_makes_no_folder(here, tmp_path, arguments):
    ended = here("keys", *arguments, OCCLUDER_DATA="nowhere")
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "OCCLUDER_DATA" in ended.stderr
    assert not (tmp_path / "nowhere").exists()


def test_what_cannot_be_done_is_told_in_a_line(here, tmp_path):
    here("keys", "create")
    unknown = here("keys", "revoke", "occ_none")
    assert unknown.returncode == 1
    (line,) = unknown.stderr.splitlines()
    assert "occ_none" in line

    file: Path = tmp_path / "occluder_data" / "occluder.db"
    with sqlite3.connect(file) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    data = bytearray(file.read_bytes())
    data[4096:12288] = b"\xa5" * 8192
    file.write_bytes(data)
    damaged = here("keys", "list")
    assert damaged.returncode == 1
    (line,) = damaged.stderr.splitlines()
    assert "damaged" in line
