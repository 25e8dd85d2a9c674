"""What every store of blobs must do about bytes that rot: nobody gets them whole, they are put
aside, and good ones come back.  One suite, to be inherited with fixtures.
"""

from __future__ import annotations

import io
import random

import pytest

from service.jobs.stores import BlobState, DamagedBlobError
from tests.service.storage.blobs.blob_store_contract import all_but, blob_of, put_now, put_stream

DATA = random.Random(1).randbytes(300_000)
CHUNK = 1 << 16


def read_in_chunks(store, blob, start=0, stop=None):
    """What was given, and whether it ended as it should."""
    given = b""
    with store.open(blob, start, stop) as reader:
        try:
            while chunk := reader.read(CHUNK):
                given += chunk
        except DamagedBlobError:
            return given, False
    return given, True


def ways_to_put(keeping, tmp_path):
    source = tmp_path / "source"
    source.write_bytes(DATA)
    yield lambda: keeping.put(io.BytesIO(DATA))
    yield lambda: keeping.put_file(source)
    yield lambda: put_stream(keeping, DATA[:7], DATA[7:])


class BlobDamageContract:
    """Needs fixtures ``store``, empty; ``inventory``, of the same; ``rot``, which flips a bit at
    a place of a blob, or of what was put aside; and ``opened_anew``, another store of the same
    place.
    """

    @pytest.mark.parametrize("at", [0, 150_000, -1])
    def test_nobody_gets_the_end_of_a_damaged_blob_and_then_it_is_stored_no_more(
        self, store, inventory, rot, tmp_path, at
    ):
        blob = put_now(store, DATA)
        rot(blob, at)
        given, ended = read_in_chunks(store, blob)
        assert not ended
        assert len(given) == len(DATA) - len(DATA) % CHUNK  # all but the last chunk
        assert not store.has(blob)
        assert list(store.digests()) == []
        assert list(inventory.digests_aside()) == [blob.digest]
        assert store.broken_reads == 1
        with pytest.raises(KeyError):
            store.open(blob)
        with pytest.raises(KeyError):
            store.lay_out(blob, tmp_path / "place")
        with store.keeping() as keeping, pytest.raises(KeyError):
            keeping.adopt(blob)

    @pytest.mark.parametrize(("start", "stop"), [(0, 10), (100_000, 100_001), (299_999, 300_000)])
    @pytest.mark.parametrize("at", [5, 100_000, -1])
    def test_a_part_of_a_damaged_blob_is_not_given_wherever_the_damage_is(
        self, store, rot, start, stop, at
    ):
        blob = put_now(store, DATA)
        rot(blob, at)
        assert read_in_chunks(store, blob, start, stop) == (b"", False)
        assert not store.has(blob)

    def test_a_part_is_read_alone_once_the_whole_was_found_right(self, store, monkeypatch):
        blob = put_now(store, DATA)
        assert read_in_chunks(store, blob, 7, 9) == (DATA[7:9], True)
        monkeypatch.setattr("service.storage.blobs.reading.hashlib", None)  # nothing is hashed
        assert read_in_chunks(store, blob, 9, 12) == (DATA[9:12], True)

    @pytest.mark.parametrize("way", range(3))
    @pytest.mark.parametrize("noticed", [True, False])
    def test_what_is_sent_again_heals_whether_or_not_anybody_had_noticed(
        self, store, inventory, rot, tmp_path, way, noticed
    ):
        blob = put_now(store, DATA)
        rot(blob)
        if noticed:
            assert not store.check(blob)
        with store.keeping() as keeping:
            assert list(ways_to_put(keeping, tmp_path))[way]() == blob
        assert store.check(blob)
        assert read_in_chunks(store, blob) == (DATA, True)
        assert list(inventory.digests_aside()) == []

    def test_checking_tells_and_marks(self, store, rot):
        blob, other = put_now(store, DATA), put_now(store, b"other")
        assert store.check(blob)
        rot(blob)
        assert not store.check(blob)
        assert store.broken_reads == 1
        assert not store.check(blob)  # it is gone by now
        assert store.broken_reads == 1
        assert store.check(other)

    def test_a_good_one_that_came_meanwhile_is_not_put_aside(self, store, inventory, rot):
        """Its file was opened before, and is judged after."""
        blob = put_now(store, DATA)
        rot(blob)
        with store.open(blob) as reader:
            put_now(store, DATA)
            with pytest.raises(DamagedBlobError):
                reader.read()
        assert store.check(blob)
        assert list(inventory.digests_aside()) == []

    def test_a_sweep_takes_what_was_put_aside_once_no_row_names_it(self, store, inventory, rot):
        blob = put_now(store, DATA)
        rot(blob)
        assert not store.check(blob)
        assert store.sweep(all_but(blob)) == 0
        assert list(inventory.digests_aside()) == [blob.digest]
        store.sweep(set)
        assert list(inventory.digests_aside()) == []

    def test_what_was_put_aside_stays_so_for_the_next_start(self, store, rot, opened_anew):
        blob = put_now(store, DATA)
        rot(blob)
        store.check(blob)
        again = opened_anew()
        assert not again.has(blob)
        assert again.corrupt == 1

    def test_what_turns_out_to_be_right_can_be_put_back(self, store, inventory, rot):
        blob = put_now(store, DATA)
        rot(blob)
        assert not store.check(blob)
        assert inventory.examine_aside(blob.digest) is BlobState.DAMAGED
        rot(blob, aside=True)  # back to what it was
        assert inventory.examine_aside(blob.digest) is BlobState.WHOLE
        inventory.put_back(blob.digest)
        assert store.check(blob)
        assert store.corrupt == 0

    def test_only_the_right_bytes_are_restored(self, store, inventory, rot):
        blob = put_now(store, DATA)
        rot(blob)
        assert not store.check(blob)
        assert not inventory.restore(blob.digest, io.BytesIO(DATA + b"x"))
        assert list(inventory.digests_aside()) == [blob.digest]
        assert set(store.digests()) == set()
        assert inventory.restore(blob.digest, io.BytesIO(DATA))
        assert store.check(blob)
        assert list(inventory.digests_aside()) == []

    def test_examining_alone_changes_nothing(self, store, inventory, rot):
        blob = put_now(store, DATA)
        read = []
        assert inventory.examine(blob.digest, read.append, aside=False) is BlobState.WHOLE
        assert sum(read) == len(DATA)
        rot(blob)
        assert inventory.examine(blob.digest, aside=False) is BlobState.DAMAGED
        assert store.has(blob)
        assert inventory.examine(blob_of(b"never").digest, aside=True) is BlobState.GONE
