"""A service whose files are in a bucket: as with a folder, and what happens while that is away."""

from __future__ import annotations

import os
import threading
import time
from contextlib import contextmanager

import boto3
import httpx
import pytest

from service.storage.blobs.bucket import Bucket
from tests.faults.serving import TIMEOUT
from tests.s3 import running_localbucket
from tests.s3_proxy import error_body, proxy_of
from tests.service.real import BOX
from tests.service.storage.blobs.s3_stores import keys_in
from tests.waiting import until


@pytest.fixture
def s3(tmp_path):
    (tmp_path / "s3").mkdir()
    with running_localbucket(tmp_path / "s3") as server:
        yield server


@pytest.fixture
def on_bucket(server):
    """``on_bucket(s3)``: a server whose files are in a new bucket of it."""

    def make(s3, **variables):
        variables = {"OCCLUDER_BLOBS": f"s3://{s3.new_bucket()}/studio"} | variables
        return server(**s3.variables | variables)

    return make


@contextmanager
def environment(s3):
    with pytest.MonkeyPatch.context() as patch:
        for name, value in s3.variables.items():
            patch.setenv(name, value)
        yield


def digests_named(serving):
    files = [
        file for job in serving.jobs()
        for file in serving.get(f"/v1/jobs/{job['id']}/files").json()["items"]
    ]  # fmt: skip
    return {file["sha256"] for file in files}


def test_files_are_taken_in_and_given_out_while_the_bucket_is_there(on_bucket, s3):
    serving = on_bucket(s3).start()
    until(serving.is_ready)
    assert "blobs" in serving.get("/readyz").json()["checks"]
    job = serving.submit()
    assert serving.end_of(job)["state"] == "succeeded"
    serving.assert_served_whole(job)
    file = f"/v1/jobs/{job}/files/lod0.obj"
    part = httpx.get(serving.address + file, headers={"Range": "bytes=3-12"})
    assert (part.status_code, part.content) == (206, (b"#\n" + BOX)[3:13])
    led = httpx.get(serving.address + file, params={"redirect": True})
    assert led.status_code == 307
    assert led.headers["cache-control"] == "no-store"
    there = httpx.get(led.headers["location"])
    assert there.content == b"#\n" + BOX
    assert there.headers["content-type"] == "model/obj"
    assert "lod0.obj" in there.headers["content-disposition"]

    s3.kill()
    away = until(lambda: (answer := serving.get("/readyz")).status_code == 503 and answer)
    assert "blobs: the connection is refused" in away.json()["detail"]
    s3.start()
    until(serving.is_ready)
    serving.assert_served_whole(job)
    serving.stop()


@pytest.mark.faults
def test_a_bucket_that_is_away_costs_no_job(on_bucket, s3, tmp_path):
    """Whoever asks meanwhile is told so; whoever works waits, and goes on by himself."""
    serving = on_bucket(s3).start()
    ready = serving.submit()
    serving.end_of(ready)
    go_on = tmp_path / "go on"
    working = serving.submit(f"# wait {go_on}")
    until(lambda: serving.job(working)["state"] == "running")
    s3.kill()
    go_on.touch()
    begun = time.monotonic()
    answer = serving.post()
    assert time.monotonic() - begun < 40.0
    assert answer.status_code == 503
    assert answer.json()["type"] == "/problems/not-ready"
    assert "connection is refused" in answer.json()["detail"]
    begun = time.monotonic()  # from now on at once
    for ask in (serving.post, lambda: serving.get(f"/v1/jobs/{ready}/files/lod0.obj")):
        assert ask().status_code == 503
    assert time.monotonic() - begun < 5.0
    assert serving.job(working)["state"] == "running"
    s3.start()
    assert serving.end_of(working)["state"] == "succeeded"
    serving.assert_served_whole(working)
    assert serving.post().status_code in (200, 202)
    serving.stop()


@pytest.mark.faults
def test_ten_seconds_of_503_are_not_noticed(on_bucket, s3):
    with proxy_of(s3) as proxy:
        serving = on_bucket(s3, AWS_ENDPOINT_URL=proxy.address).start()
        until = time.monotonic() + 10.0
        busy = 503, error_body("SlowDown")
        proxy.fault = lambda method, path: busy if time.monotonic() < until else None
        jobs = [serving.submit(f"# {number}") for number in range(3)]
        assert time.monotonic() > until
        for job in jobs:
            assert serving.end_of(job)["state"] == "succeeded"
            serving.assert_served_whole(job)
        serving.stop()


@pytest.mark.faults
def test_what_a_server_leaves_that_is_killed_in_the_midst_of_uploads_is_removed(
    on_bucket, moto, tmp_path
):
    serving = on_bucket(moto, OCCLUDER_LEASE_SECONDS="1", OCCLUDER_CLEAN_SECONDS="1").start()
    serving.end_of(serving.submit())
    place = serving._variables["OCCLUDER_BLOBS"]
    stop = threading.Event()

    def endless():
        while not stop.is_set():
            yield bytes(1 << 20)
            time.sleep(0.05)

    def upload():
        with pytest.raises(httpx.TransportError):
            httpx.post(
                f"{serving.address}/v1/occluders?filename=box.obj", content=endless(),
                timeout=TIMEOUT,
            )  # fmt: skip

    threads = [threading.Thread(target=upload) for _ in range(3)]
    with environment(moto):
        bucket = Bucket.open(place)
        client = boto3.client("s3", endpoint_url=os.environ["AWS_ENDPOINT_URL"])

        def unfinished():
            told = client.list_multipart_uploads(Bucket=bucket.address.bucket)
            return told.get("Uploads", [])

        for thread in threads:
            thread.start()
        until(lambda: len(unfinished()) == 3)
        serving.kill()
        stop.set()
        for thread in threads:
            thread.join()
        assert len(unfinished()) == 3
        serving.start()
        until(lambda: not unfinished(), 60.0)
        named = digests_named(serving)
        until(lambda: len(keys_in(bucket)) == len(named), 60.0)
    serving.stop()
