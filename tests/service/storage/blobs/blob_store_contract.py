"""What every store of blobs must do: one suite, to be inherited with a fixture ``store``."""

from __future__ import annotations

import asyncio
import hashlib
import io
from collections.abc import AsyncIterator, Callable, Collection
from contextlib import suppress

import pytest

from service.jobs.job import Blob
from service.jobs.stores import BlobStore, Keeping


def blob_of(data: bytes) -> Blob:
    return Blob(hashlib.sha256(data).hexdigest(), len(data))


async def stream(*chunks: bytes) -> AsyncIterator[bytes]:
    for chunk in chunks:
        yield chunk


def put_stream(keeping: Keeping, *chunks: bytes) -> Blob:
    return asyncio.run(keeping.put_stream(stream(*chunks)))


def put_now(store: BlobStore, data: bytes) -> Blob:
    """Stored, and kept by nothing any more."""
    with store.keeping() as keeping:
        return keeping.put(io.BytesIO(data))


def all_but(*named: Blob) -> Callable[[Collection[str]], set[str]]:
    """What a sweep asks, where rows name these; ``set`` is where they name none."""
    return lambda digests: set(digests) - {blob.digest for blob in named}


SIZES = [0, 1, 5000, (1 << 20) - 1, 1 << 20, (5 << 20) + 3]


class BlobStoreContract:
    """Needs a fixture ``store``, empty."""

    @pytest.mark.parametrize("size", SIZES)
    def test_what_is_put_is_read_back(self, store, tmp_path, size):
        data = bytes(i % 251 for i in range(1000)) * (size // 1000 + 1)
        data = data[:size]
        file = tmp_path / "source"
        file.write_bytes(data)
        with store.keeping() as keeping:
            blob = keeping.put(io.BytesIO(data))
            assert blob == blob_of(data)
            assert keeping.put_file(file) == blob
            assert put_stream(keeping, data[:7], b"", data[7:]) == blob
        assert store.check(blob)
        assert store.has(blob)
        assert store.is_right(blob)
        with store.open(blob) as opened:
            assert opened.read() == data
            assert opened.read() == b""
        with store.open(blob) as opened:
            pieces = list(iter(lambda: opened.read(100_003), b""))
            assert b"".join(pieces) == data
        for start, stop in ((0, size // 2), (size // 2, None), (size // 3, size // 2)):
            with store.open(blob, start, stop) as opened:
                assert opened.read() == data[start:stop]
        store.lay_out(blob, tmp_path / "laid out")
        assert (tmp_path / "laid out").read_bytes() == data
        assert set(store.digests()) == {blob.digest}

    def test_a_file_is_moved_in(self, store, tmp_path):
        for _ in range(2):  # the second time an equal blob is there
            file = tmp_path / "result.glb"
            file.write_bytes(b"result")
            with store.keeping() as keeping:
                assert keeping.put_file(file) == blob_of(b"result")
            assert not file.exists()

    @pytest.mark.parametrize(
        "blob",
        [
            blob_of(b"never stored"),
            Blob("../../etc/passwd", 4),
            Blob("..", 0),
            Blob("", 0),
            Blob("/" * 64, 1),
            Blob("ab" + "/" + "c" * 61, 1),
            Blob(blob_of(b"there").digest.upper(), 5),
            Blob(blob_of(b"there").digest + "\n", 5),
            Blob(blob_of(b"there").digest, 6),
        ],
        ids=repr,
    )
    def test_what_is_not_there_is_a_key_error(self, store, blob, tmp_path):
        put_now(store, b"there")
        with pytest.raises(KeyError):
            store.open(blob)
        with pytest.raises(KeyError):
            store.lay_out(blob, tmp_path / "place")
        assert not (tmp_path / "place").exists()
        with store.keeping() as keeping, pytest.raises(KeyError):
            keeping.adopt(blob)
        with suppress(KeyError):  # of what is no digest
            assert not store.is_right(blob)
            assert not store.has(blob)

    def test_a_broken_stream_stores_nothing_and_its_error_passes_through(self, store):
        async def broken() -> AsyncIterator[bytes]:
            yield b"x" * (3 << 20)
            raise ConnectionError("gone")

        with store.keeping() as keeping, pytest.raises(ConnectionError, match="gone"):
            asyncio.run(keeping.put_stream(broken()))
        assert list(store.digests()) == []

    def test_a_cancelled_stream_stores_nothing(self, store):
        async def endless() -> AsyncIterator[bytes]:
            yield b"x" * (3 << 20)
            await asyncio.Event().wait()

        async def main() -> None:
            with store.keeping() as keeping:
                async with asyncio.timeout(0.05):
                    await keeping.put_stream(endless())

        with pytest.raises(TimeoutError):
            asyncio.run(main())
        assert list(store.digests()) == []

    def test_many_streams_at_once_do_not_mix(self, store):
        contents = [bytes([i]) * (i * 40_000) for i in range(30)]

        async def slowly(data: bytes) -> AsyncIterator[bytes]:
            for begin in range(0, len(data), 65_536):
                yield data[begin : begin + 65_536]
                await asyncio.sleep(0)

        async def main() -> list[Blob]:
            with store.keeping() as keeping:
                return await asyncio.gather(*(keeping.put_stream(slowly(d)) for d in contents))

        assert asyncio.run(main()) == [blob_of(data) for data in contents]
        assert set(store.digests()) == {blob_of(data).digest for data in contents}

    def test_a_sweep_removes_what_is_neither_named_nor_kept(self, store):
        named, dropped = put_now(store, b"named"), put_now(store, b"dropped")
        with store.keeping() as keeping:
            fresh = keeping.put(io.BytesIO(b"fresh"))
            found = put_now(store, b"found")
            keeping.adopt(found)
            assert store.sweep(all_but(named)) == 1
            assert set(store.digests()) == {named.digest, fresh.digest, found.digest}
            with pytest.raises(KeyError):
                store.open(dropped)
        assert store.sweep(all_but(named, found)) == 1
        assert set(store.digests()) == {named.digest, found.digest}

    def test_a_keeping_that_failed_keeps_no_longer(self, store):
        with suppress(ZeroDivisionError), store.keeping() as keeping:
            keeping.put(io.BytesIO(b"in vain"))
            raise ZeroDivisionError
        assert store.sweep(set) == 1

    def test_one_of_two_keepings_is_enough(self, store):
        with store.keeping() as first:
            first.put(io.BytesIO(b"shared"))
            with store.keeping() as second:
                second.put(io.BytesIO(b"shared"))
            assert store.sweep(set) == 0
        assert store.sweep(set) == 1

    def test_an_ended_keeping_refuses(self, store):
        with store.keeping() as keeping:
            blob = keeping.put(io.BytesIO(b"x"))
        with pytest.raises(RuntimeError):
            keeping.put(io.BytesIO(b"y"))
        with pytest.raises(RuntimeError):
            keeping.adopt(blob)
        assert store.sweep(set) == 1
        assert list(store.digests()) == []

    def test_what_comes_after_the_names_were_read_stays(self, store):
        """The rows of these are committed, and their keepings ended, within the sweep."""
        old = put_now(store, b"found in the midst")
        gone = put_now(store, b"nobody's")

        def unnamed(digests: Collection[str]) -> set[str]:
            nobodys = set(digests)  # read before what follows
            put_now(store, b"put in the midst")
            with store.keeping() as keeping:
                keeping.adopt(old)
            return nobodys

        assert store.sweep(unnamed) == 1
        assert set(store.digests()) == {old.digest, blob_of(b"put in the midst").digest}
        with pytest.raises(KeyError):
            store.open(gone)
        assert store.sweep(set) == 2  # what was noted is forgotten with the sweep

    def test_what_was_kept_when_the_sweep_began_stays(self, store):
        keeping = store.keeping()
        blob = keeping.__enter__().put(io.BytesIO(b"kept until its row is committed"))

        def unnamed(digests: Collection[str]) -> set[str]:
            keeping.__exit__(None, None, None)
            return set(digests)

        assert store.sweep(unnamed) == 0
        assert list(store.digests()) == [blob.digest]

    def test_a_failed_sweep_leaves_the_store_as_it_was(self, store):
        blob = put_now(store, b"x")

        def broken(digests: Collection[str]) -> set[str]:
            raise OSError("no database")

        with pytest.raises(OSError, match="no database"):
            store.sweep(broken)
        assert list(store.digests()) == [blob.digest]
        assert store.sweep(set) == 1

    def test_there_is_room(self, store):
        assert store.free_bytes() > 0
