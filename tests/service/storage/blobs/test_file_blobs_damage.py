"""Blobs in files whose bytes rot: the contract, and what disks do on top of it."""

from __future__ import annotations

import errno
import io

import pytest

from service.jobs.stores import DamagedBlobError
from service.storage.blobs.file_blobs import FileBlobs
from tests.service.storage.blobs.blob_damage_contract import (
    DATA,
    BlobDamageContract,
    read_in_chunks,
)
from tests.service.storage.blobs.blob_store_contract import put_now
from tests.service.storage.blobs.rot import flip


@pytest.fixture
def store(tmp_path):
    return FileBlobs(tmp_path / "blobs")


@pytest.fixture
def inventory(store):
    return store.places


@pytest.fixture
def rot(store):
    def change(blob, at=-1, *, aside=False):
        flip(store.places.place_aside(blob.digest) if aside else store.path(blob), at)

    return change


@pytest.fixture
def opened_anew(tmp_path):
    return lambda: FileBlobs(tmp_path / "blobs")


class TestFileBlobs(BlobDamageContract):
    """Files that rot."""


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
