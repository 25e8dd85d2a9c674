"""``occluder serve`` where files cannot be stored as it is told to: a line, and status 2."""

from __future__ import annotations

import os
import sys
import time

import pytest

from service.settings import Settings
from service.storage.blobs.bucket import Bucket
from service.storage.opening import open_storage
from tests.postgres import free_port
from tests.s3_proxy import error_body, proxy_of

REFUSED_SECONDS = 15.0


@pytest.fixture
def refusal(here):
    """``refusal(OCCLUDER_BLOBS=…)``: the line."""

    def serve(*arguments, **variables):
        begun = time.monotonic()
        ended = here("serve", "--port", "0", *arguments, **variables)
        assert time.monotonic() - begun < REFUSED_SECONDS
        assert ended.returncode == 2, ended.stderr
        (line,) = ended.stderr.splitlines()
        assert line.startswith("error: ")
        return line

    return serve


@pytest.fixture
def on_moto(moto, monkeypatch):
    for name, value in moto.variables.items():
        monkeypatch.setenv(name, value)
    return moto


@pytest.fixture
def shared(postgres, tmp_path):
    """Settings of servers that share a database."""
    address = postgres.database()
    (tmp_path / "secret").write_bytes(os.urandom(32))
    (tmp_path / "secret").chmod(0o600)
    yield {
        "OCCLUDER_DATABASE_URL": address, "OCCLUDER_SECRET_FILE": str(tmp_path / "secret"),
        "OCCLUDER_ENGINE": "none",
    }  # fmt: skip
    postgres.drop(address)


def test_a_bucket_that_is_missing(refusal, on_moto):
    assert "is in no bucket that there is; make the bucket" in refusal(
        OCCLUDER_BLOBS="s3://nowhere/studio"
    )


@pytest.mark.parametrize(
    ("status", "body", "words"),
    [
        (403, error_body("AccessDenied"), "denies what is asked of it (AccessDenied); allow s3:"),
        (
            400, error_body("AuthorizationHeaderMalformed", "<Region>eu-west-3</Region>"),
            "is in another region than 'us-east-1'; set AWS_REGION=eu-west-3",
        ),
    ],
    ids=["denied", "another region"],
)  # fmt: skip
def test_a_bucket_that_is_not_for_us(refusal, on_moto, status, body, words):
    with proxy_of(on_moto) as proxy:
        proxy.fault = lambda method, path: (status, body)
        told = refusal(OCCLUDER_BLOBS="s3://studio/blobs", AWS_ENDPOINT_URL=proxy.address)
    assert words in told


def test_a_server_of_buckets_that_is_not_there(refusal, on_moto):
    away = f"http://127.0.0.1:{free_port()}"
    told = refusal(OCCLUDER_BLOBS="s3://studio", AWS_ENDPOINT_URL=away)
    assert "cannot be reached (the connection is refused); check AWS_ENDPOINT_URL" in told


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_a_bucket_of_another_database(kind, request, refusal, on_moto):
    variables = request.getfixturevalue("shared") if kind == "postgres" else {}
    place = f"s3://{on_moto.new_bucket()}/studio"
    Bucket.open(place).write_identity("another")
    told = refusal(OCCLUDER_BLOBS=place, **variables)
    assert f"the files in '{place}' belong to another database" in told
    assert f"remove '{place}/identity'" in told


@pytest.fixture
def first(shared, tmp_path):
    """Settings of the first server, which has its files in a folder."""
    return Settings(
        data=tmp_path / "host-1", database_url=shared["OCCLUDER_DATABASE_URL"],
        secret_file=shared["OCCLUDER_SECRET_FILE"],
    )  # fmt: skip


def test_folders_of_several_hosts(refusal, shared, first):
    with open_storage(first):
        told = refusal("--data", "host-2", **shared)
    assert "a folder serves one host, several need OCCLUDER_BLOBS=s3://BUCKET/PREFIX" in told


def test_a_folder_that_was_used_by_mistake_can_be_left(refusal, here, shared, first, on_moto):
    with open_storage(first):
        """Nothing was stored."""
    place = f"s3://{on_moto.new_bucket()}/studio"
    told = refusal(OCCLUDER_BLOBS=place, **shared)
    assert "bring them to a bucket: occluder verify --repair --from FOLDER" in told
    brought = here(
        "verify", "--repair", "--from", first.data, OCCLUDER_BLOBS=place,
        OCCLUDER_DATABASE_URL=shared["OCCLUDER_DATABASE_URL"],
    )  # fmt: skip
    assert brought.returncode == 0, brought.stderr
    with open_storage(first.model_copy(update={"blobs": place})):
        """It can be used."""
    told = refusal("--data", "host-1", **shared)
    assert f"the files of this database are in '{place}', and those in" in told


def test_what_is_no_address(refusal):
    assert "OCCLUDER_BLOBS cannot be '/mnt/blobs': must be s3://BUCKET/PREFIX" in refusal(
        OCCLUDER_BLOBS="/mnt/blobs"
    )


def test_without_the_client_it_is_told_what_to_install(refusal, on_moto, monkeypatch):
    monkeypatch.delitem(sys.modules, "service.storage.blobs.bucket", raising=False)
    monkeypatch.setitem(sys.modules, "obstore", None)
    told = refusal(OCCLUDER_BLOBS="s3://studio")
    assert "OCCLUDER_BLOBS needs 'obstore', which is not installed; run: pip install" in told
