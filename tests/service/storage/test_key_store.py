"""Keys: made, found, revoked."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import text

from service.access.key import Scope
from service.access.session import Session
from service.errors import ConflictError, NotFoundError
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
        keys.end_session(Session("key", expires, name))
    assert keys.ended_sessions(clock.now) == {"a": soon, "b": late}
    clock.now += 50.0
    keys.end_session(Session("key", late, "c"))
    assert keys.ended_sessions(0.0) == {"b": late, "c": late}
