"""Blobs in a bucket whose bytes rot, or are gone: the contract, and what comes on top of it."""

from __future__ import annotations

import pytest

from service.jobs.stores import BlobState, DamagedBlobError
from tests.service.storage.blobs.blob_damage_contract import (
    DATA,
    BlobDamageContract,
    read_in_chunks,
)
from tests.service.storage.blobs.blob_store_contract import all_but, put_now
from tests.service.storage.blobs.s3_stores import keys_in, memory_bucket, store_in


@pytest.fixture
def bucket():
    return memory_bucket()


@pytest.fixture
def store(bucket, database, tmp_path):
    return store_in(bucket, database, tmp_path)


@pytest.fixture
def inventory(store):
    return store._inventory


@pytest.fixture
def opened_anew(bucket, database, tmp_path):
    return lambda: store_in(bucket, database, tmp_path)


@pytest.fixture
def rot(store, bucket):
    def change(blob, at=-1, *, aside=False):
        key, _ = store._ledger.find(blob.digest, aside=aside)
        data = bytearray(bucket.get(key, 0, 1 << 30))
        data[at] ^= 0x10
        bucket.put(key, data)

    return change


class TestS3Blobs(BlobDamageContract):
    """Objects that are others than were put."""


@pytest.fixture
def lose(store, bucket):
    def remove(blob):
        bucket.delete([store._ledger.key_of(blob)])

    return remove


def test_what_is_gone_from_the_bucket_is_stored_no_more_once_somebody_has_noticed(
    store, inventory, lose, tmp_path
):
    blob = put_now(store, DATA)
    lose(blob)
    assert store.has(blob)  # as far as can be told without looking
    with pytest.raises(KeyError):
        store.open(blob)
    assert not store.has(blob)
    assert inventory.examine_aside(blob.digest) is BlobState.GONE
    put_now(store, DATA)
    assert read_in_chunks(store, blob) == (DATA, True)
    assert list(inventory.digests_aside()) == []


def test_what_is_gone_is_found_by_reading_all_of_it(store, inventory, lose):
    blob = put_now(store, DATA)
    lose(blob)
    assert inventory.examine(blob.digest, aside=False) is BlobState.GONE
    assert store.has(blob)
    assert not store.check(blob)
    assert not store.has(blob)


def test_what_goes_while_it_is_read_ends_the_reading(store, bucket, lose, monkeypatch):
    monkeypatch.setattr("service.storage.blobs.s3_reading._FIRST", 1000)
    blob = put_now(store, DATA)
    with store.open(blob) as reader:
        reader.read(10)
        lose(blob)
        with pytest.raises(DamagedBlobError, match="it is gone"):
            reader.read()
    assert not store.has(blob)


def test_a_shorter_and_a_longer_object_are_damage(store, bucket):
    for data in (DATA[:-1], DATA + b"x"):
        blob = put_now(store, DATA)
        bucket.put(store._ledger.key_of(blob), data)
        assert not store.check(blob)
        assert store.corrupt == 1


def test_who_reads_goes_on_with_the_object_that_came_in_place_of_his(store, bucket, monkeypatch):
    """By then a sweep has removed the one that he began with."""
    monkeypatch.setattr("service.storage.blobs.s3_reading._FIRST", 1000)
    blob = put_now(store, DATA)
    with store.open(blob) as reader:
        begin = reader.read(10)
        before = keys_in(bucket)
        put_now(store, DATA)
        store.sweep(all_but(blob))
        store.sweep(all_but(blob))
        assert keys_in(bucket).isdisjoint(before)
        assert begin + reader.read() == DATA


def test_pieces_of_two_objects_of_which_one_was_damaged_put_none_aside(
    store, bucket, rot, monkeypatch
):
    monkeypatch.setattr("service.storage.blobs.s3_reading._FIRST", 1000)
    blob = put_now(store, DATA)
    rot(blob, 0)
    with store.open(blob) as reader:
        reader.read(10)
        put_now(store, DATA)
        store.sweep(all_but(blob))
        with pytest.raises(DamagedBlobError, match="others than were stored"):
            reader.read()
    assert store.check(blob)
