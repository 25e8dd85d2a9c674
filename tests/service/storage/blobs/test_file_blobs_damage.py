"""Blobs whose bytes rot: nobody gets them whole, they are put aside, and good ones come back."""

from __future__ import annotations

import errno
import io
import random

import pytest

from service.jobs.stores import BlobState, DamagedBlobError
from service.storage.blobs.file_blobs import FileBlobs
from service.storage.blobs.places import BlobPlaces
from tests.service.storage.blobs.blob_store_contract import all_but, blob_of, put_now, put_stream
from tests.service.storage.blobs.rot import flip

DATA = random.Random(1).randbytes(300_000)
CHUNK = 1 << 16


@pytest.fixture
def store(tmp_path):
    return FileBlobs(tmp_path / "blobs")


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


@pytest.mark.parametrize("at", [0, 150_000, -1])
def test_nobody_gets_the_end_of_a_damaged_blob_and_then_it_is_stored_no_more(store, at):
    blob = put_now(store, DATA)
    flip(store.path(blob), at)
    given, ended = read_in_chunks(store, blob)
    assert not ended
    assert len(given) == len(DATA) - len(DATA) % CHUNK  # all but the last chunk
    assert not store.has(blob)
    assert list(store.digests()) == []
    assert store.places.digests_aside() == [blob.digest]
    assert store.broken_reads == 1
    for look in (store.open, store.path):
        with pytest.raises(KeyError):
            look(blob)
    with store.keeping() as keeping, pytest.raises(KeyError):
        keeping.adopt(blob)


@pytest.mark.parametrize(("start", "stop"), [(0, 10), (100_000, 100_001), (299_999, 300_000)])
@pytest.mark.parametrize("at", [5, 100_000, -1])
def test_a_part_of_a_damaged_blob_is_not_given_wherever_the_damage_is(store, start, stop, at):
    blob = put_now(store, DATA)
    flip(store.path(blob), at)
    assert read_in_chunks(store, blob, start, stop) == (b"", False)
    assert not store.has(blob)


def test_a_part_is_read_alone_once_the_whole_was_found_right(store, monkeypatch):
    blob = put_now(store, DATA)
    assert read_in_chunks(store, blob, 7, 9) == (DATA[7:9], True)
    monkeypatch.setattr("service.storage.blobs.reading.hashlib", None)  # nothing is hashed
    assert read_in_chunks(store, blob, 9, 12) == (DATA[9:12], True)


def test_what_was_found_right_is_looked_at_again_once_it_was_written_to_or_time_has_passed(
    store, monkeypatch
):
    blob = put_now(store, DATA)
    assert read_in_chunks(store, blob, 7, 9)[1]
    path = store.path(blob)
    path.chmod(0o600)
    path.write_bytes(b"x" * len(DATA))
    assert not read_in_chunks(store, blob, 7, 9)[1]

    put_now(store, DATA)
    assert read_in_chunks(store, blob, 7, 9)[1]
    with monkeypatch.context() as patch:
        patch.setattr("service.storage.blobs.file_blobs._FileSource.mark", ())
        store._trusted._clock = lambda now=store._trusted._clock: now() + 601.0
        flip(store.path(blob))
        assert not read_in_chunks(store, blob, 7, 9)[1]


def test_a_file_that_gets_shorter_while_it_is_read_ends_the_reading(store):
    blob = put_now(store, DATA)
    path = store.path(blob)
    with store.open(blob) as reader:
        reader.read(10)
        path.chmod(0o600)
        with path.open("r+b") as file:
            file.truncate(1000)
        with pytest.raises(DamagedBlobError, match="missing"):
            reader.read()
    assert not store.has(blob)


def test_a_disk_that_cannot_read_is_damage_as_well(store, monkeypatch):
    blob = put_now(store, DATA)

    class BadSector(io.RawIOBase):
        def __init__(self, file):
            self._file = file

        def fileno(self):
            return self._file.fileno()

        def read(self, size=-1):
            raise OSError(errno.EIO, "Input/output error")

        def close(self):
            self._file.close()

    reader = store.open(blob)
    reader._source._file = BadSector(reader._source._file)
    with reader, pytest.raises(DamagedBlobError, match="Input/output error"):
        reader.read()
    assert store.places.digests_aside() == [blob.digest]


def ways_to_put(keeping, tmp_path):
    source = tmp_path / "source"
    source.write_bytes(DATA)
    yield lambda: keeping.put(io.BytesIO(DATA))
    yield lambda: keeping.put_file(source)
    yield lambda: put_stream(keeping, DATA[:7], DATA[7:])


@pytest.mark.parametrize("way", range(3))
@pytest.mark.parametrize("noticed", [True, False])
def test_what_is_sent_again_heals_whether_or_not_anybody_had_noticed(store, tmp_path, way, noticed):
    blob = put_now(store, DATA)
    flip(store.path(blob))
    if noticed:
        assert not store.check(blob)
    with store.keeping() as keeping:
        assert list(ways_to_put(keeping, tmp_path))[way]() == blob
    assert store.check(blob)
    assert store.path(blob).read_bytes() == DATA
    assert store.places.digests_aside() == []


def test_checking_tells_and_marks(store):
    blob, other = put_now(store, DATA), put_now(store, b"other")
    assert store.check(blob)
    flip(store.path(blob))
    assert not store.check(blob)
    assert store.broken_reads == 1
    assert not store.check(blob)  # it is gone by now
    assert store.broken_reads == 1
    assert store.check(other)


def test_a_good_one_that_came_meanwhile_is_not_put_aside(store):
    """Its file was opened before, and is judged after."""
    blob = put_now(store, DATA)
    flip(store.path(blob))
    with store.open(blob) as reader:
        put_now(store, DATA)
        with pytest.raises(DamagedBlobError):
            reader.read()
    assert store.check(blob)
    assert store.places.digests_aside() == []


def test_a_good_one_that_comes_in_the_last_moment_is_put_back(store, monkeypatch):
    blob = put_now(store, DATA)
    path = store.path(blob)
    flip(path)
    seen = path.stat()
    real = type(path).replace

    def late(self, target):
        if self == path:
            monkeypatch.setattr(type(path), "replace", real)
            path.unlink()
            put_now(store, DATA)
        return real(self, target)

    monkeypatch.setattr(type(path), "replace", late)
    with path.open("rb"):  # so that its number cannot become the other's
        assert not store.places.put_aside(blob.digest, seen)
    assert path.read_bytes() == DATA
    assert store.places.digests_aside() == []


def test_a_sweep_takes_what_was_put_aside_once_no_row_names_it(store):
    blob = put_now(store, DATA)
    flip(store.path(blob))
    assert not store.check(blob)
    assert store.sweep(all_but(blob)) == 0
    assert store.places.digests_aside() == [blob.digest]
    store.sweep(set)
    assert store.places.digests_aside() == []


def test_what_was_put_aside_stays_so_for_the_next_start(store, tmp_path):
    blob = put_now(store, DATA)
    flip(store.path(blob))
    store.check(blob)
    again = FileBlobs(tmp_path / "blobs")
    assert not again.has(blob)
    assert again.places.digests_aside() == [blob.digest]


def test_examining_alone_changes_nothing(store, tmp_path):
    blob = put_now(store, DATA)
    places, read = BlobPlaces(tmp_path / "blobs"), []
    assert places.examine(blob.digest, read.append, aside=False) is BlobState.WHOLE
    assert sum(read) == len(DATA)
    flip(store.path(blob))
    assert places.examine(blob.digest, aside=False) is BlobState.DAMAGED
    assert store.has(blob)
    assert places.examine(blob_of(b"never").digest, aside=True) is BlobState.GONE
