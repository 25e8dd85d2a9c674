"""A bucket that is missing, denied, elsewhere, away or busy: what is said, and how soon."""

from __future__ import annotations

import asyncio
import socket
import time
from datetime import UTC, datetime
from urllib.parse import parse_qsl, urlsplit

import botocore.auth
import pytest
from botocore.awsrequest import AWSRequest
from botocore.credentials import Credentials

from service.errors import DiskFullError, NotReadyError, SettingsError
from service.storage.blobs.bucket import Bucket
from service.storage.blobs.bucket_faults import in_words, settings_fault
from service.storage.blobs.signing import signed_address
from tests.postgres import free_port
from tests.s3 import running_localbucket
from tests.s3_proxy import error_body, proxy_of
from tests.service.storage.blobs.s3_stores import keys_in
from tests.waiting import until

START_SECONDS = 15.0
"""Within which a bucket that cannot be used is refused."""


@pytest.fixture
def told_of_moto(moto, monkeypatch):
    """The environment."""
    for name, value in moto.variables.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def proxy(moto, told_of_moto, monkeypatch):
    with proxy_of(moto) as proxy:
        monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.address)
        yield proxy


@pytest.fixture
def bucket(proxy, moto):
    return Bucket.open(f"s3://{moto.new_bucket()}/studio")


def refusal(url: str) -> str:
    """What is said of it, in one line, with what to do, soon."""
    begun = time.monotonic()
    with pytest.raises(SettingsError) as refused:
        Bucket.open(url).check()
    assert time.monotonic() - begun < START_SECONDS
    told = str(refused.value)
    assert "\n" not in told
    assert "; " in told
    return told


def test_what_can_be_used_is_told_so_and_nothing_is_left_of_the_look(server):
    bucket = Bucket.open(f"s3://{server.new_bucket()}/studio")
    bucket.check()
    assert bucket.problem() is None
    assert keys_in(bucket) == set()
    assert bucket.read_identity() is None
    bucket.write_identity("studio")
    assert Bucket.open(f"s3://{bucket.address.bucket}/studio").read_identity() == "studio"
    assert Bucket.open(f"s3://{bucket.address.bucket}/other").read_identity() is None


def test_a_bucket_that_is_missing_is_told_so(server):
    told = refusal("s3://no-such-bucket/studio")
    assert told.startswith(
        "OCCLUDER_BLOBS=s3://no-such-bucket/studio is in no bucket that there is"
    )
    assert "make the bucket" in told


@pytest.mark.parametrize(
    ("status", "body", "words"),
    [
        (403, error_body("AccessDenied"), ("denies what is asked", "AccessDenied", "s3:PutObject")),
        (403, error_body("InvalidAccessKeyId"), ("refuses the credentials", "AWS_ACCESS_KEY_ID")),
        (403, error_body("SignatureDoesNotMatch"), ("credentials", "AWS_SECRET_ACCESS_KEY")),
        (301, error_body("PermanentRedirect"), ("another region than 'us-east-1'", "AWS_REGION")),
        (
            400,
            error_body("AuthorizationHeaderMalformed", "<Region>eu-west-1</Region>"),
            ("another region than 'us-east-1'", "set AWS_REGION=eu-west-1"),
        ),
        (500, "oops", ("cannot be reached (it answers 500)", "AWS_ENDPOINT_URL")),
        (200, "<html>a portal</html>", ("cannot be", "AWS_ENDPOINT_URL")),
    ],
)  # fmt: skip
def test_what_the_server_refuses_is_told_with_what_to_do(proxy, status, body, words):
    proxy.fault = lambda method, path: (status, body)
    told = refusal("s3://studio/blobs")
    assert all(word in told for word in words), told


@pytest.mark.parametrize("method", ["PUT", "DELETE"])
def test_a_bucket_that_may_only_be_read_is_refused(proxy, moto, method):
    denied = method, "POST"  # by which many are deleted
    proxy.fault = lambda told, path: (403, error_body("AccessDenied")) if told in denied else None
    assert "denies what is asked" in refusal(f"s3://{moto.new_bucket()}")


def test_a_server_that_is_not_there_is_told_so(told_of_moto, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{free_port()}")
    assert "cannot be reached (the connection is refused)" in refusal("s3://studio")


def test_a_server_that_does_not_answer_is_told_so(told_of_moto, monkeypatch):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{silent.getsockname()[1]}")
        assert "no answer in time" in refusal("s3://studio")


def test_tls_that_is_none_is_told_so(moto, told_of_moto, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", moto.address.replace("http", "https"))
    assert "it does not speak TLS" in refusal("s3://studio")


def test_without_credentials_it_is_told_so():
    told = "Error performing PUT http://169.254.169.254/latest/api/token in 1ms - HTTP error"
    assert "there are none; set AWS_ACCESS_KEY_ID" in settings_fault("s3://studio", told)


def test_plain_http_has_to_be_asked_for(told_of_moto, monkeypatch):
    monkeypatch.delenv("AWS_ALLOW_HTTP")
    assert "AWS_ALLOW_HTTP=true" in refusal("s3://studio")


def test_settings_that_mean_nothing_are_told_so(told_of_moto, monkeypatch):
    monkeypatch.setenv("AWS_CONDITIONAL_PUT", "nonsense")
    assert "AWS_* variables cannot be used" in refusal("s3://studio")


def test_reasons_in_words():
    assert in_words("whatever") == "no answer"
    assert in_words(f"status code: 503: {error_body('SlowDown')}") == "it answers 503 SlowDown"


def test_a_server_that_is_busy_for_seconds_is_not_noticed(proxy, bucket):
    """Small ones, parts, reading and listing, each of which meets it."""
    busy = {"left": 12}

    def fault(method: str, path: str) -> tuple[int, str] | None:
        busy["left"] -= 1
        return (503, error_body("SlowDown")) if busy["left"] % 3 else None

    proxy.fault = fault
    bucket.put("a" * 32, b"small")
    bucket.put_parts("b" * 32, iter([bytes(5 << 20), b"end"]), 5 << 20)
    asyncio.run(bucket.put_async("c" * 32, b"small"))
    assert bytes(bucket.get("b" * 32, (5 << 20) + 1, 1 << 30)) == b"nd"
    assert keys_in(bucket) == {letter * 32 for letter in "abc"}
    bucket.problem()  # meets it as well, and whoever looks may
    bucket.delete(["a" * 32, "b" * 32])
    assert keys_in(bucket) == {"c" * 32}


def test_one_that_stays_away_is_told_at_once_from_then_on_and_used_again_when_it_is_back(
    proxy, bucket, monkeypatch, caplog
):
    monkeypatch.setattr("service.storage.blobs.bucket._PATIENT_RETRY", {"max_retries": 2})
    monkeypatch.setattr("service.storage.blobs.bucket._GLANCE", 0.05)
    bucket = Bucket.open(f"s3://{bucket.address.bucket}")
    proxy.fault = lambda method, path: (503, error_body("ServiceUnavailable"))
    with pytest.raises(NotReadyError, match="it answers 503 ServiceUnavailable"):
        bucket.put("a" * 32, b"x")
    asked = len(proxy.seen)
    for _ in range(100):
        with pytest.raises(NotReadyError, match="it answers 503 ServiceUnavailable"):
            bucket.put("a" * 32, b"x")
    assert len(proxy.seen) - asked < 50  # a look now and then
    assert bucket.problem() == "it answers 503 ServiceUnavailable"
    proxy.fault = lambda method, path: None
    until(lambda: bucket.problem() is None)
    bucket.put("a" * 32, b"x")
    assert caplog.text.count("cannot be used") == 1


def test_a_bucket_that_is_full_is_no_fault_of_the_server(proxy, bucket):
    proxy.fault = lambda method, path: (
        (403, error_body("QuotaExceeded")) if method == "PUT" else None
    )
    with pytest.raises(DiskFullError, match="takes no more"):
        bucket.put("a" * 32, b"x")
    assert bucket.problem() is None


def test_a_bucket_that_is_removed_is_not_taken_for_lost_objects(proxy, bucket):
    bucket.put("a" * 32, b"x")
    proxy.fault = lambda method, path: (404, error_body("NoSuchBucket"))
    with pytest.raises(NotReadyError, match="NoSuchBucket"):
        bucket.get("a" * 32, 0, 1)


def test_a_server_that_is_killed_and_started_again_is_used_again(tmp_path, monkeypatch):
    with running_localbucket(tmp_path) as server:
        for name, value in server.variables.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr("service.storage.blobs.bucket._PATIENT_RETRY", {"max_retries": 2})
        bucket = Bucket.open(f"s3://{server.new_bucket()}")
        bucket.put("a" * 32, b"kept")
        server.kill()
        assert bucket.problem() == "the connection is refused"
        with pytest.raises(NotReadyError, match="connection is refused"):
            bucket.get("a" * 32, 0, 4)
        server.start()
        until(lambda: bucket.problem() is None)
        assert bytes(bucket.get("a" * 32, 0, 4)) == b"kept"


def test_unfinished_uploads_of_a_server_that_cannot_list_them_are_left(localbucket, monkeypatch):
    for name, value in localbucket.variables.items():
        monkeypatch.setenv(name, value)
    Bucket.open(f"s3://{localbucket.new_bucket()}").abort_uploads("a" * 32)


@pytest.mark.parametrize("path", ["studio/" + "a" * 32, ""])
def test_addresses_are_signed_as_others_sign_them(monkeypatch, path):
    """Byte by byte what botocore makes of the same request at the same time."""
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "key")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "se/cret+")
    monkeypatch.setenv("AWS_SESSION_TOKEN", "to/ken+=")
    monkeypatch.setenv("AWS_REGION", "eu-central-1")
    for name in ("AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3"):
        monkeypatch.delenv(name, raising=False)
    query = {"uploadId": "a+b/c=", "prefix": "stu dio"}
    signed = urlsplit(signed_address("DELETE", "bucket", path, query, 60))
    assert signed.netloc == "s3.eu-central-1.amazonaws.com"
    assert signed.path.strip("/") == f"bucket/{path}".strip("/")
    told = dict(parse_qsl(signed.query, keep_blank_values=True))
    assert query.items() <= told.items()

    when = datetime.strptime(told["X-Amz-Date"], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
    monkeypatch.setattr(botocore.auth, "get_current_datetime", lambda **_: when)
    plain = "&".join(part for part in signed.query.split("&") if not part.startswith("X-Amz-"))
    request = AWSRequest("DELETE", signed._replace(query=plain).geturl())
    credentials = Credentials("key", "se/cret+", "to/ken+=")
    botocore.auth.S3SigV4QueryAuth(credentials, "s3", "eu-central-1", 60).add_auth(request)
    theirs = dict(parse_qsl(urlsplit(request.url).query))
    assert told["X-Amz-Signature"] == theirs["X-Amz-Signature"]
