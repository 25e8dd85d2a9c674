"""Blobs in files: what comes on top of the contract."""

from __future__ import annotations

import asyncio
import io
import os
import resource
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager

import pytest

from service.errors import DiskFullError, SettingsError
from service.storage.blobs import file_blobs
from service.storage.blobs.file_blobs import FileBlobs
from tests.service.storage.blobs.blob_store_contract import (
    BlobStoreContract,
    all_but,
    blob_of,
    put_now,
    put_stream,
    stream,
)

MIB = 1 << 20


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "blobs"


@pytest.fixture
def store(folder):
    return FileBlobs(folder)


def drafts(folder):
    return list((folder / "drafts").iterdir())


class TestFileBlobs(BlobStoreContract):
    """Whatever a test of the contract does, no draft is left behind."""

    @pytest.fixture(autouse=True)
    def _tidy(self, store, folder):
        yield
        assert drafts(folder) == []


def test_nobody_can_write_to_a_blob(store, tmp_path):
    source = tmp_path / "source"
    source.write_bytes(b"moved")
    with store.keeping() as keeping:
        blobs = [keeping.put(io.BytesIO(b"put")), keeping.put_file(source)]
        blobs.append(put_stream(keeping, b"streamed"))
    assert {store.path(blob).stat().st_mode & 0o777 for blob in blobs} == {0o400}


def test_an_equal_blob_takes_the_place_of_the_one_that_was_there(store):
    path = store.path(put_now(store, b"same"))
    before = path.stat()
    with path.open("rb") as reading:
        put_now(store, b"same")
        assert reading.read() == b"same"  # whoever reads the old one goes on
    assert path.stat().st_ino != before.st_ino
    assert [one.name for one in path.parent.iterdir()] == [path.name]


def test_a_link_is_not_moved_in(store, tmp_path):
    (tmp_path / "secret").write_bytes(b"secret")
    (tmp_path / "result").symlink_to(tmp_path / "secret")
    with store.keeping() as keeping:
        with pytest.raises(OSError):
            keeping.put_file(tmp_path / "result")
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(ValueError, match="no file"):
            keeping.put_file(tmp_path / "pipe")
    assert list(store.digests()) == []


def test_files_of_others_are_left_alone(store, folder):
    (folder / "ab" / "README").write_text("not a blob")
    assert store.sweep(set) == 0
    assert list(store.digests()) == []
    assert (folder / "ab" / "README").exists()


def test_drafts_of_a_killed_server_are_removed_at_the_start(store, folder):
    blob = put_now(store, b"stored")
    (folder / "drafts" / "0123.tmp").write_bytes(b"half")
    again = FileBlobs(folder)
    assert drafts(folder) == []
    assert list(again.digests()) == [blob.digest]


def test_a_folder_that_cannot_be_made_is_a_matter_of_settings(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SettingsError, match="blobs"):
        FileBlobs(tmp_path / "file" / "blobs")


def every_way(keeping, data, tmp_path):
    yield lambda: keeping.put(io.BytesIO(data))
    yield lambda: put_stream(keeping, *(data[i : i + MIB] for i in range(0, len(data), MIB)))
    yield lambda: put_stream(keeping, data)


def test_room_is_left_to_others(folder, tmp_path):
    store = FileBlobs(folder, min_free=FileBlobs(folder).free_bytes() + MIB)
    with store.keeping() as keeping:
        for put in every_way(keeping, b"x" * 3 * MIB, tmp_path):
            with pytest.raises(DiskFullError, match="left free"):
                put()
    assert drafts(folder) == []
    assert list(store.digests()) == []


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """A real refusal of the system, in place of a full disk: EFBIG."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_disk_that_fills_up_in_the_midst_leaves_nothing_behind(store, folder, tmp_path):
    data = b"x" * 5 * MIB
    with store.keeping() as keeping, largest_file(3 * MIB + 17):
        for put in every_way(keeping, data, tmp_path):
            with pytest.raises(DiskFullError, match="File too large"):
                put()
        assert drafts(folder) == []
    assert put_now(store, data) == blob_of(data)


def test_the_loop_runs_on_while_the_disk_is_busy(store, monkeypatch):
    """A write that hangs must not keep other requests waiting."""
    hangs, go_on = threading.Event(), threading.Event()
    real = os.write

    def hanging(handle: int, data: memoryview) -> int:
        hangs.set()
        assert go_on.wait(10)
        return real(handle, data)

    async def main() -> None:
        with store.keeping() as keeping:
            put = asyncio.create_task(keeping.put_stream(stream(b"x" * 2 * MIB, b"y" * MIB)))
            while not hangs.is_set():
                await asyncio.sleep(0)
            monkeypatch.setattr(os, "write", real)
            go_on.set()
            assert await put == blob_of(b"x" * 2 * MIB + b"y" * MIB)

    monkeypatch.setattr(os, "write", hanging)
    asyncio.run(main())


@pytest.mark.parametrize("times", [1, 2])
def test_an_upload_cancelled_within_a_write_leaves_nothing_behind(
    store, folder, monkeypatch, times
):
    """Twice is what a server in a hurry does; then nobody waits for the removal."""
    hangs, go_on = threading.Event(), threading.Event()
    real = os.write

    def hanging(handle: int, data: memoryview) -> int:
        hangs.set()
        assert go_on.wait(10)
        return real(handle, data)

    async def endless() -> AsyncIterator[bytes]:
        while True:
            yield b"x" * MIB
            await asyncio.sleep(0)

    async def main() -> None:
        with store.keeping() as keeping:
            put = asyncio.create_task(keeping.put_stream(endless()))
            while not hangs.is_set():
                await asyncio.sleep(0)
            for _ in range(times):
                put.cancel()
                await asyncio.sleep(0)
            go_on.set()
            with pytest.raises(asyncio.CancelledError):
                await put
            assert times == 2 or drafts(folder) == []

    monkeypatch.setattr(os, "write", hanging)
    asyncio.run(main())  # waits for the threads of its pool
    assert drafts(folder) == []
    assert list(store.digests()) == []


def test_a_sweep_between_the_move_and_the_row_takes_nothing(store, monkeypatch):
    real = store.publish

    def swept(path, blob):
        real(path, blob)
        assert store.sweep(set) == 0

    monkeypatch.setattr(store, "publish", swept)
    blob = put_now(store, b"just moved")
    assert list(store.digests()) == [blob.digest]


def test_a_sweep_asks_after_some_at_a_time(store, monkeypatch):
    monkeypatch.setattr(file_blobs, "_BATCH", 3)
    blobs = [put_now(store, str(number).encode()) for number in range(8)]
    asked: list[list[str]] = []

    def unnamed(digests):
        asked.append(list(digests))
        return all_but(blobs[2], blobs[7])(digests)

    assert store.sweep(unnamed) == 6
    assert [len(batch) for batch in asked] == [3, 3, 2]
    assert sorted(one for batch in asked for one in batch) == sorted(blob.digest for blob in blobs)
    assert set(store.digests()) == {blobs[2].digest, blobs[7].digest}
