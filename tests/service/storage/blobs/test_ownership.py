"""Signs of life of a process that puts blobs, and how it ends."""

from __future__ import annotations

import threading

import pytest
from sqlalchemy import func, select

from service.errors import NotReadyError
from service.storage.blobs.ledger import BlobLedger
from service.storage.blobs.ownership import Ownership
from service.storage.blobs.tables import BlobHoldRow, BlobObjectRow, BlobOwnerRow, ObjectState
from tests.service.storage.blobs.blob_store_contract import blob_of
from tests.waiting import until

BLOB = blob_of(b"x")


@pytest.fixture
def ledger(database, clock):
    return BlobLedger(database, clock, lease=0.2)


def count(database, table, *where):
    with database.reading() as session:
        return session.scalars(select(func.count()).select_from(table).where(*where)).one()


def until_when(database):
    with database.reading() as session:
        return session.scalars(select(BlobOwnerRow.until)).one()


def test_it_lives_while_the_block_lasts_and_leaves_nothing(ledger, database, clock):
    ownership = Ownership(ledger)
    with ownership.living():
        ledger.publish(ownership.name, "keeping", ownership.key(), BLOB)
        abandoned = ownership.key()
        clock.now += 10.0
        until(lambda: until_when(database) > clock.now)
        ownership.end_keeping("keeping")
        ownership.abandon(abandoned)
        until(lambda: count(database, BlobHoldRow) == 0)
        until(lambda: [key for key, _ in ledger.doomed()] == [abandoned])
        ledger.publish(ownership.name, "another", ownership.key(), blob_of(b"y"))
    assert not [one for one in threading.enumerate() if one.name == "blob holds"]
    assert count(database, BlobOwnerRow) == count(database, BlobHoldRow) == 0
    assert count(database, BlobObjectRow, BlobObjectRow.state == ObjectState.WRITING) == 0
    assert count(database, BlobObjectRow, BlobObjectRow.state == ObjectState.STORED) == 2


def test_it_goes_on_after_trouble_and_forgets_nothing(ledger, database, monkeypatch, caplog):
    ownership, faults = Ownership(ledger), [RuntimeError("a fault"), NotReadyError("away")]
    real = ledger.renew

    def renew(*given):
        if faults:
            raise faults.pop()
        return real(*given)

    monkeypatch.setattr(ledger, "renew", renew)
    ledger.publish(ownership.name, "keeping", ownership.key(), BLOB)
    with ownership.living():
        ownership.end_keeping("keeping")
        until(lambda: count(database, BlobHoldRow) == 0)
    assert caplog.text.count("cannot be renewed") == 2


def test_who_is_taken_for_dead_goes_on_by_another_name(ledger, clock, database):
    ownership = Ownership(ledger)
    name, key = ownership.name, ownership.key()
    clock.now += 1.0
    assert ledger.bury_dead() == 1
    ownership.show_life()
    assert ownership.name != name
    assert key in {one for one, _ in ledger.doomed()}
    fresh = ownership.key()
    assert ledger.publish(ownership.name, "keeping", fresh, BLOB) is False
    assert ledger.key_of(BLOB) == fresh


def test_a_key_is_had_though_the_process_was_taken_for_dead(ledger, clock):
    ownership = Ownership(ledger)
    clock.now += 1.0
    ledger.bury_dead()
    key = ownership.key()
    assert ledger.publish(ownership.name, "keeping", key, BLOB) is False


def test_of_two_that_begin_anew_one_name_is_left(ledger, database, clock):
    ownership = Ownership(ledger)
    clock.now += 1.0
    ledger.bury_dead()
    before = ownership.name
    ownership._begin_anew(before)
    now = ownership.name
    ownership._begin_anew(before)  # another thread, which was late
    assert ownership.name == now
    assert count(database, BlobOwnerRow) == 1
