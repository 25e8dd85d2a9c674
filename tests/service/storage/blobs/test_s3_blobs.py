"""Blobs in a bucket: the contract on two servers, and what comes on top of it."""

from __future__ import annotations

import asyncio
import io
import os
import random
import subprocess
import sys
from collections.abc import AsyncIterator
from functools import cache

import boto3
import httpx
import pytest

from service.storage.blobs.bucket import Bucket
from tests.acceptance.command import ROOT
from tests.s3_proxy import proxy_of
from tests.service.storage.blobs.blob_store_contract import (
    BlobStoreContract,
    blob_of,
    put_now,
    put_stream,
)
from tests.service.storage.blobs.s3_stores import keys_in, store_in

DATABASES = {"moto": "sqlite_database", "localbucket": "postgres_database"}
"""By kind of server: each has the whole contract with one kind of database."""


@pytest.fixture
def database(request, server):
    return request.getfixturevalue(DATABASES[server.name])


@pytest.fixture
def bucket(server):
    return Bucket.open(f"s3://{server.new_bucket()}/studio/blobs")


@pytest.fixture
def store(bucket, database, tmp_path):
    return store_in(bucket, database, tmp_path)


LARGE = random.Random(1).randbytes((5 << 20) + 12_345)
"""It is sent in two parts."""


class TestS3Blobs(BlobStoreContract):
    """Whatever a test of the contract does, two sweeps leave nothing in the bucket."""

    @pytest.fixture(autouse=True)
    def _tidy(self, store, bucket):
        yield
        store.sweep(set)
        store.sweep(set)
        assert keys_in(bucket) == set()
        assert unfinished(bucket) == []


@cache
def client_of(endpoint):
    return boto3.client("s3", endpoint_url=endpoint)


def unfinished(bucket) -> list[str]:
    """Keys of uploads that were begun and never made whole; as moto tells, localbucket cannot."""
    client = client_of(os.environ["AWS_ENDPOINT_URL"])
    try:
        told = client.list_multipart_uploads(Bucket=bucket.address.bucket)
    except client.exceptions.ClientError:
        return []
    return [upload["Key"] for upload in told.get("Uploads", [])]


async def drip(data: bytes) -> AsyncIterator[bytes]:
    for begin in range(0, len(data), 100_000):
        yield data[begin : begin + 100_000]


def test_small_ones_go_in_one_request_and_large_ones_in_parts(server, database, tmp_path):
    with proxy_of(server) as proxy, pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", proxy.address)
        store = store_in(Bucket.open(f"s3://{server.new_bucket()}"), database, tmp_path)
        proxy.seen.clear()
        with store.keeping() as keeping:
            keeping.put(io.BytesIO(b"small"))
            put_stream(keeping, b"small", b" too")
            assert [method for method, _ in proxy.seen] == ["PUT", "PUT"]
            proxy.seen.clear()
            keeping.put(io.BytesIO(LARGE))
            assert [method for method, _ in proxy.seen] == ["POST", "PUT", "PUT", "POST"]
            proxy.seen.clear()
            asyncio.run(keeping.put_stream(drip(LARGE)))
            assert [method for method, _ in proxy.seen] == ["POST", "PUT", "PUT", "POST"]


@pytest.mark.parametrize("ending", ["error", "cancelled"])
def test_a_large_upload_that_breaks_off_leaves_no_parts(store, bucket, ending):
    """They are dropped at once, before any sweep."""

    async def broken() -> AsyncIterator[bytes]:
        async for chunk in drip(LARGE + LARGE):
            yield chunk
        if ending == "error":
            raise ConnectionError("gone")
        await asyncio.Event().wait()

    async def main() -> None:
        with store.keeping() as keeping:
            async with asyncio.timeout(0.5 if ending == "cancelled" else 30.0):
                await keeping.put_stream(broken())

    with pytest.raises(ConnectionError if ending == "error" else TimeoutError):
        asyncio.run(main())
    assert keys_in(bucket) == set()
    assert unfinished(bucket) == []
    assert list(store.digests()) == []


def test_a_source_that_fails_leaves_no_parts(store, bucket):
    class Broken(io.BytesIO):
        def read(self, size=-1):
            if self.tell() > 2 * len(LARGE):
                raise OSError("the disk is away")
            return super().read(size)

    with store.keeping() as keeping, pytest.raises(OSError, match="the disk is away"):
        keeping.put(Broken(3 * LARGE))
    assert keys_in(bucket) == set()
    assert unfinished(bucket) == []


UPLOADS = """
import asyncio, sys
from pathlib import Path
from service.storage.blobs.bucket import Bucket
from service.storage.sqlite import SqliteDatabase
from tests.service.storage.blobs.s3_stores import store_in
database = SqliteDatabase.open(Path(sys.argv[2]))
store = store_in(Bucket.open(sys.argv[1]), database, Path(sys.argv[3]))
async def forever():
    while True:
        yield bytes(1 << 20)
        print("sent", flush=True)
async def main():
    with store.keeping() as keeping:
        await keeping.put_stream(forever())
asyncio.run(main())
"""


def test_what_a_killed_upload_leaves_is_removed_by_the_sweep_after_its_lease(
    moto, monkeypatch, sqlite_database, file, tmp_path, clock
):
    """Parts that S3 keeps, and bills, for ever."""
    for name, value in moto.variables.items():
        monkeypatch.setenv(name, value)
    place = f"s3://{moto.new_bucket()}/blobs"
    command = [sys.executable, "-c", UPLOADS, place, str(file), str(tmp_path)]
    bucket = Bucket.open(place)
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)}
    ) as process:
        for _ in range(16):  # more than a part, and more than can be in memory
            assert process.stdout.readline()
        process.kill()
    (key,) = unfinished(bucket)
    store = store_in(bucket, sqlite_database, tmp_path)
    store.sweep(set)
    assert unfinished(bucket) == [key]  # it may be alive
    clock.now += 10**9  # seconds
    later = store_in(bucket, sqlite_database, tmp_path, clock=clock)
    later.sweep(set)
    assert unfinished(bucket) == []


def test_a_signed_address_gives_the_bytes_to_whoever_has_it(store):
    blob = put_now(store, b"result" * 1000)
    address = store.signed_url(blob, "model/gltf-binary", 'attachment; filename="a b.glb"')
    answer = httpx.get(address, headers={"Range": "bytes=0-5"})
    assert (answer.status_code, answer.content) == (206, b"result")
    assert answer.headers["content-type"] == "model/gltf-binary"
    assert answer.headers["content-disposition"] == 'attachment; filename="a b.glb"'
    with pytest.raises(KeyError):
        store.signed_url(blob_of(b"never"), "a/b", "inline")


def test_nobody_else_can_read_what_is_laid_out(store, tmp_path):
    blob = put_now(store, b"mesh")
    store.lay_out(blob, tmp_path / "mesh.obj")
    assert (tmp_path / "mesh.obj").stat().st_mode & 0o777 == 0o400
