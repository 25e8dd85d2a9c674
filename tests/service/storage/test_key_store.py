"""Keys: made, found, revoked."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import Engine, event, text

from service.access.key import Scope
from service.access.session import Session
from service.errors import ConflictError, InvalidOptionsError, NotFoundError
from service.storage.database import Database
from service.storage.key_store import SqlKeyStore
from tests.service.storage.samples import Clock


def test_a_key_is_found_by_its_secret(keys: SqlKeyStore, clock: Clock) -> None:
    key, secret = keys.create("studio", "build farm", Scope.WRITE)
    assert (key.tenant, key.name, key.scope) == ("studio", "build farm", Scope.WRITE)
    assert (key.created, key.last_used, key.revoked) == (clock.now, None, None)
    assert secret.startswith(key.hint)
    assert keys.find(secret) == key
    assert keys.find(secret + "x") is None


def test_the_secret_is_nowhere_in_the_files(
    keys: SqlKeyStore, database: Database, file: Path
) -> None:
    _, secret = keys.create("studio", "build farm", Scope.READ)
    keys.find(secret)
    database.close()
    for stored in file.parent.iterdir():
        assert secret[8:].encode() not in stored.read_bytes()


@pytest.mark.parametrize("by", ["id", "hint"])
def test_a_revoked_key_is_not_found(keys: SqlKeyStore, clock: Clock, by: str) -> None:
    key, secret = keys.create("studio", "build farm", Scope.READ)
    _, other = keys.create("studio", "laptop", Scope.READ)
    assert keys.revoke(getattr(key, by)).revoked == clock.now
    assert keys.find(secret) is None
    assert keys.find(other)
    clock.now += 5.0
    assert keys.revoke(key.id).revoked == clock.now - 5.0


def test_what_is_no_key_is_told(keys: SqlKeyStore) -> None:
    with pytest.raises(NotFoundError, match="occ_none"):
        keys.revoke("occ_none")


def test_a_hint_of_two_keys_revokes_neither(keys: SqlKeyStore, database: Database) -> None:
    first, _ = keys.create("studio", "one", Scope.READ)
    second, secret = keys.create("studio", "two", Scope.READ)
    with database.writing() as session:
        session.execute(text("UPDATE api_keys SET hint = 'occ_same'"))
    named = f"{first.id} of studio one; {second.id} of studio two"
    with pytest.raises(ConflictError, match=f"2 keys begin with 'occ_same'; .*: {named}"):
        keys.revoke("occ_same")
    assert keys.find(secret)
    keys.revoke(first.id)
    assert keys.revoke("occ_same").id == second.id  # the only one that is left
    assert keys.revoke("occ_same").id == first.id


def test_the_use_of_a_key_is_noted_once_a_minute(keys: SqlKeyStore, clock: Clock) -> None:
    _, secret = keys.create("studio", "build farm", Scope.READ)
    begun = clock.now

    def used_at(moment: float) -> float | None:
        clock.now = moment
        keys.find(secret)
        return keys.keys()[0].last_used

    assert used_at(begun) == begun
    assert used_at(begun + 59.0) == begun
    assert used_at(begun + 60.0) == begun + 60.0
    assert used_at(begun - 86400.0) == begun - 86400.0  # the clock was set back


def test_of_those_who_find_a_key_at_once_one_notes_it(
    keys: SqlKeyStore, database: Database, clock: Clock
) -> None:
    """A thousand answers a minute are one write."""
    _, secret = keys.create("studio", "build farm", Scope.READ)
    written: list[str] = []

    def look(connection: object, cursor: object, statement: str, *_: object) -> None:
        if statement.startswith("UPDATE"):
            written.append(statement)

    event.listen(Engine, "before_cursor_execute", look)
    try:
        for _ in range(60):
            clock.now += 0.9
            keys.find(secret)
            keys.key(keys.keys()[0].id)
    finally:
        event.remove(Engine, "before_cursor_execute", look)
    assert len(written) == 1


def test_a_session_is_a_use_of_its_key(keys: SqlKeyStore, clock: Clock) -> None:
    key, _ = keys.create("studio", "build farm", Scope.READ)
    keys.key(key.id)
    assert keys.keys()[0].last_used == clock.now


def test_a_key_expires(keys: SqlKeyStore, clock: Clock) -> None:
    end = clock.now + 60.0
    key, secret = keys.create("studio", "build farm", Scope.READ, expires=end)
    assert keys.find(secret) == key
    clock.now = end - 0.1
    assert keys.key(key.id)
    clock.now = end
    assert keys.find(secret) is None
    assert keys.key(key.id) is None
    with pytest.raises(InvalidOptionsError, match="expires: it is over already"):
        keys.create("studio", "late", Scope.READ, expires=end)


def test_a_rotated_key_works_until_the_overlap_ends(keys: SqlKeyStore, clock: Clock) -> None:
    old, before = keys.create("studio", "build farm", Scope.WRITE)
    clock.now += 1000.0
    turned = clock.now
    done = keys.rotate(old.hint, overlap=86_400.0)
    assert (done.new.tenant, done.new.name, done.new.scope) == ("studio", "build farm", Scope.WRITE)
    assert (done.new.replaces, done.old.id, done.old.revoked) == (old.id, old.id, turned + 86_400.0)
    for moment in (turned, turned + 86_399.0):
        clock.now = moment
        assert keys.find(before)
        assert keys.find(done.secret)
    clock.now = turned + 86_400.0
    assert keys.find(before) is None
    assert keys.find(done.secret)


def test_a_key_that_leaked_ends_before_its_overlap(keys: SqlKeyStore, clock: Clock) -> None:
    old, before = keys.create("studio", "build farm", Scope.WRITE)
    done = keys.rotate(old.id, overlap=86_400.0)
    assert keys.revoke(old.id).revoked == clock.now
    assert keys.find(before) is None
    assert keys.find(done.secret)
    at_once = keys.rotate(done.new.id, overlap=0.0)
    assert keys.find(done.secret) is None
    assert keys.find(at_once.secret)


def test_the_new_key_lives_as_long_as_the_old_one(keys: SqlKeyStore, clock: Clock) -> None:
    old, before = keys.create("studio", "build farm", Scope.READ, expires=clock.now + 900.0)
    clock.now += 800.0
    done = keys.rotate(old.id, overlap=3600.0)
    assert done.new.expires == clock.now + 900.0
    clock.now += 100.0
    assert keys.find(before) is None  # an overlap makes nothing live longer
    chosen = keys.rotate(done.new.id, overlap=0.0, expires=clock.now + 5.0)
    assert chosen.new.expires == clock.now + 5.0


def test_what_cannot_be_rotated(keys: SqlKeyStore, clock: Clock) -> None:
    old, _ = keys.create("studio", "build farm", Scope.READ)
    done = keys.rotate(old.id, overlap=60.0)
    with pytest.raises(ConflictError, match=f"'{done.new.id}' replaces"):
        keys.rotate(old.id, overlap=60.0)
    keys.revoke(done.new.id)
    with pytest.raises(ConflictError, match="has ended"):
        keys.rotate(done.new.id, overlap=60.0)
    assert keys.rotate(old.id, overlap=60.0).new.replaces == old.id  # the first try went wrong
    for overlap in (-1.0, 90 * 86_400.0 + 1.0, float("nan")):
        with pytest.raises(InvalidOptionsError, match="overlap"):
            keys.rotate(old.id, overlap=overlap)
    with pytest.raises(NotFoundError):
        keys.rotate(old.id, overlap=60.0, tenant="rival")
    with pytest.raises(NotFoundError):
        keys.revoke(old.id, tenant="rival")


def test_keys_are_listed_by_tenant(keys: SqlKeyStore) -> None:
    ours, _ = keys.create("studio", "one", Scope.READ)
    theirs, _ = keys.create("rival", "two", Scope.ADMIN)
    assert keys.keys() == [ours, theirs]
    assert keys.keys("studio") == [ours]
    assert set(keys.tenants()) == {"studio", "rival"}


def test_sessions_that_were_signed_out_are_known_until_they_are_over(
    keys: SqlKeyStore, clock: Clock
) -> None:
    soon, late = int(clock.now) + 10, int(clock.now) + 100
    for name, expires in (("a", soon), ("b", late), ("b", late)):
        keys.end_session(Session("key", expires, name), "192.0.2.7")
    assert keys.ended_sessions(clock.now) == {"a": soon, "b": late}
    clock.now += 50.0
    keys.end_session(Session("key", late, "c"), "192.0.2.7")
    assert keys.ended_sessions(0.0) == {"b": late, "c": late}
