"""Who did what: written with what was done, read by page, forgotten when old."""

from __future__ import annotations

import pytest

from service.access.key import Caller, Scope
from service.access.session import Session
from service.errors import ConflictError, DiskFullError
from service.journal import Action, Actor
from service.storage.database import Database
from service.storage.journal_store import SqlJournal
from service.storage.key_store import SqlKeyStore
from tests.service.storage.samples import Clock

ANNA = Actor("a" * 32, "192.0.2.7")


def lines(journal: SqlJournal, tenant: str | None = None) -> list[tuple[str, str, str]]:
    return [(one.actor, one.action, one.subject) for one in journal.entries(tenant).entries]


def test_keys_that_are_made_rotated_and_revoked_are_written_down(
    keys: SqlKeyStore, journal: SqlJournal, clock: Clock
) -> None:
    made, _ = keys.create("studio", "ci", Scope.READ)
    done = keys.rotate(made.id, overlap=60.0, by=ANNA)
    keys.revoke(done.new.id, by=ANNA)
    keys.revoke(done.new.id, by=ANNA)  # nothing more comes of it
    assert lines(journal) == [
        (ANNA.name, "key-revoked", done.new.id),
        (ANNA.name, "key-rotated", made.id),
        ("command-line", "key-made", made.id),
    ]
    turned = journal.entries("studio").entries[1]
    assert (turned.at, turned.tenant, turned.address) == (clock.now, "studio", "192.0.2.7")
    assert turned.details == {
        "name": "ci", "scope": "read", "expires": None, "new": done.new.id,
        "until": clock.now + 60.0,
    }  # fmt: skip


def test_what_is_refused_is_not_written_down(keys: SqlKeyStore, journal: SqlJournal) -> None:
    made, _ = keys.create("studio", "ci", Scope.READ)
    keys.rotate(made.id, overlap=60.0)
    with pytest.raises(ConflictError):
        keys.rotate(made.id, overlap=60.0)
    assert [what for _, what, _ in lines(journal)] == ["key-rotated", "key-made"]


def test_sessions_are_written_down_once(
    keys: SqlKeyStore, journal: SqlJournal, clock: Clock
) -> None:
    key, _ = keys.create("studio", "desk", Scope.READ)
    keys.begin_session(Caller("studio", Scope.READ, key.id), "192.0.2.7")
    session = Session(key.id, int(clock.now) + 10, "one")
    keys.end_session(session, "192.0.2.8")
    keys.end_session(session, "192.0.2.8")
    out, entered = journal.entries("studio").entries[:2]
    assert (out.action, out.actor, out.subject, out.address) == (
        "signed-out", key.id, key.id, "192.0.2.8",
    )  # fmt: skip
    assert (entered.action, entered.actor, entered.address) == ("signed-in", key.id, "192.0.2.7")
    assert len(journal.entries(None).entries) == 3


def test_a_full_disk_keeps_nobody_out(
    keys: SqlKeyStore, database: Database, monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    key, _ = keys.create("studio", "desk", Scope.READ)

    def full() -> None:
        raise DiskFullError("there is no room for the database")

    monkeypatch.setattr(database, "writing", full)
    keys.begin_session(Caller("studio", Scope.READ, key.id), "192.0.2.7")
    assert f"key {key.id} signed in" in caplog.text


def test_entries_come_by_page_by_tenant_and_since_a_time(journal: SqlJournal, clock: Clock) -> None:
    begin = clock.now
    for number in range(5):
        clock.now = begin + number
        journal.note("studio", ANNA, Action.ASSET_REMOVED, f"a{number}")
        journal.note("rival", ANNA, Action.ASSET_REMOVED, f"r{number}")
    page = journal.entries("studio", limit=2)
    assert [one.subject for one in page.entries] == ["a4", "a3"]
    page = journal.entries("studio", limit=2, before=page.cursor)
    assert [one.subject for one in page.entries] == ["a2", "a1"]
    page = journal.entries("studio", limit=2, before=page.cursor)
    assert ([one.subject for one in page.entries], page.cursor) == (["a0"], None)
    recent = journal.entries(None, since=begin + 4.0)
    assert [one.subject for one in recent.entries] == ["r4", "a4"]


def test_old_entries_are_forgotten_and_their_numbers_do_not_come_again(
    journal: SqlJournal, clock: Clock
) -> None:
    for _ in range(3):
        journal.note("studio", ANNA, Action.SIGNED_IN, ANNA.name)
        clock.now += 10.0
    last = journal.entries("studio").entries[0].number
    assert journal.expire(clock.now - 15.0) == 2
    assert journal.expire(clock.now - 15.0) == 0
    assert [one.number for one in journal.entries("studio").entries] == [last]
    assert journal.expire(clock.now + 1.0) == 1
    journal.note("studio", ANNA, Action.SIGNED_IN, ANNA.name)
    assert journal.entries("studio").entries[0].number == last + 1
