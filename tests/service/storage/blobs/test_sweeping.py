"""Sweeps of a bucket by several instances: what goes, what stays, and when nothing may go."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Collection

import pytest

from service.errors import HoldLostError, NotReadyError
from service.jobs.stores import FOLDERS
from service.storage.blobs.ledger import rely_on
from tests.service.storage.blobs.blob_store_contract import all_but, blob_of, put_now
from tests.service.storage.blobs.racing import Rows, race
from tests.service.storage.blobs.s3_stores import keys_in, memory_bucket, store_in

LEASE = 100.0


@pytest.fixture
def bucket():
    return memory_bucket()


@pytest.fixture
def instance(bucket, database, tmp_path, clock):
    """``instance()`` is one more server on the bucket."""
    return lambda: store_in(bucket, database, tmp_path, clock=clock, lease=LEASE)


def test_what_one_instance_keeps_no_other_sweeps(instance):
    one, other = instance(), instance()
    with one.keeping() as keeping:
        blob = keeping.put(io.BytesIO(b"about to be named"))
        assert other.sweep(set) == 0
        found = put_now(other, b"found")
        keeping.adopt(found)
        assert other.sweep(set) == 0
    one.sweep(all_but(blob, found))  # with which its holds have gone
    assert other.sweep(all_but(blob)) == 1
    assert list(one.digests()) == [blob.digest]


def test_an_object_outlives_its_blob_by_one_sweep(instance, bucket):
    """Whoever was about to read it has that long."""
    store = instance()
    put_now(store, b"x")
    assert store.sweep(set) == 1
    assert list(store.digests()) == []
    assert len(keys_in(bucket)) == 1
    assert store.sweep(set) == 0
    assert keys_in(bucket) == set()


def test_holds_of_a_dead_instance_end_with_its_lease(instance, bucket, clock):
    dead, other = instance(), instance()
    keeping = dead.keeping()
    keeping.__enter__().put(io.BytesIO(b"in vain"))
    clock.now += LEASE - 1
    assert other.sweep(set) == 0
    clock.now += 2
    assert other.sweep(set) == 1


def test_who_was_taken_for_dead_is_told_and_leaves_nothing(instance, bucket, clock, database):
    held_up, other = instance(), instance()
    block = held_up.keeping()
    keeping = block.__enter__()
    blob = keeping.put(io.BytesIO(b"stored in time"))
    clock.now += LEASE + 1
    other.sweep(set)
    for late in (lambda: keeping.put(io.BytesIO(b"too late")), lambda: keeping.adopt(blob)):
        with pytest.raises(HoldLostError, match="send it again"):
            late()
    with pytest.raises(HoldLostError), database.writing() as session:
        rely_on(session, [blob])
    other.sweep(set)
    assert keys_in(bucket) == set()
    assert put_now(held_up, b"sent again") == blob_of(b"sent again")  # by another name


def test_what_a_row_names_that_came_in_the_last_moment_stays(instance, database):
    """Its hold was lost, and the sweep is past looking at names."""
    store = instance()
    blob = put_now(store, b"x")

    def unnamed(digests: Collection[str]) -> Collection[str]:
        with database.writing() as session:
            rely_on(session, [blob])
        return digests

    assert store.sweep(unnamed) == 0
    assert list(store.digests()) == [blob.digest]


def test_a_sweep_that_is_killed_before_it_has_removed_is_gone_on_with(
    instance, bucket, monkeypatch
):
    store = instance()
    put_now(store, b"x")
    store.sweep(set)
    with monkeypatch.context() as patch:
        patch.setattr(bucket, "delete", lambda keys: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            store.sweep(set)
    assert len(keys_in(bucket)) == 1
    instance().sweep(set)
    assert keys_in(bucket) == set()


def test_a_sweep_asks_after_some_at_a_time(instance, monkeypatch):
    monkeypatch.setattr("service.storage.blobs.ledger._BATCH", 3)
    store = instance()
    blobs = [put_now(store, str(number).encode()) for number in range(8)]
    asked: list[int] = []

    def unnamed(digests: Collection[str]) -> set[str]:
        asked.append(len(digests))
        return all_but(blobs[2], blobs[7])(digests)

    assert store.sweep(unnamed) == 6
    assert asked == [3, 3, 2]
    assert set(store.digests()) == {blobs[2].digest, blobs[7].digest}


def test_what_no_row_knows_goes_with_time(instance, bucket):
    """As after the database was put back as it was earlier; each sweep looks at a part."""
    store = instance()
    kept = put_now(store, b"kept")
    for number in range(FOLDERS):
        bucket.put(hashlib.md5(bytes([number])).hexdigest(), b"of another time")
    bucket.put("README", b"not ours")
    for _ in range(FOLDERS):
        store.sweep(all_but(kept))
    assert len(keys_in(bucket)) == 1
    assert bytes(bucket.get("README", 0, 100)) == b"not ours"


def test_a_bucket_that_has_become_another_s_is_not_swept(instance, bucket):
    store = instance()
    put_now(store, b"x")
    bucket.write_identity("of another")
    with pytest.raises(NotReadyError, match="belongs to another database"):
        store.sweep(set)
    assert len(list(store.digests())) == len(keys_in(bucket)) == 1


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_no_sweep_takes_what_a_row_names(kind, request, bucket, tmp_path):
    """Few contents and many threads of two instances, so that all meet all the time."""
    database = request.getfixturevalue(f"{kind}_database")
    stores = [store_in(bucket, database, tmp_path) for _ in "ab"]

    def rely(blob) -> None:
        with database.writing() as session:
            rely_on(session, [blob])

    def sweep() -> int:
        removed = stores[0].sweep(rows.unnamed)
        stores[1]._ownership.show_life()  # which ends its holds
        return removed

    rows = Rows(rely)
    race(stores, rows, [bytes([i]) * 100 for i in range(4)], sweep, 20)
    for store in 2 * stores:
        store.sweep(rows.unnamed)
    assert keys_in(bucket) == set()
