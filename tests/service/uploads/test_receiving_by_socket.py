"""Uploads over raw connections to a real server: rude, slow and broken clients."""

from __future__ import annotations

import resource
import socket
import subprocess
import sys
import time
from contextlib import ExitStack

import pytest

from service.settings import Settings
from service.storage.blobs.file_blobs import FileBlobs
from service.uploads import body
from tests.service.storage.blobs.blob_store_contract import blob_of
from tests.service.uploads.upload_server import Connection, served
from tests.waiting import until

MIB = 1 << 20


@pytest.fixture
def store(tmp_path):
    return FileBlobs(tmp_path)


@pytest.fixture
def connect(store, request):
    """Connections to a server of its own, with the settings that the test is marked with."""
    limits = getattr(request, "param", {})
    with ExitStack() as stack:
        port = stack.enter_context(served(store, Settings(**limits)))
        yield lambda: stack.enter_context(Connection(port))


def is_left_behind(store, tmp_path):
    return bool(list((tmp_path / "drafts").iterdir()) or list(store.digests()))


def limits(**values):
    return pytest.mark.parametrize("connect", [values], indirect=True, ids=[""])


def test_an_upload_is_stored(connect, store):
    data = bytes(range(256)) * 10_000
    client = connect()
    client.send(f"Content-Length: {len(data)}", body=data)
    status, _, answer = client.answer()
    assert (status, answer.decode()) == (200, f'"{blob_of(data).digest}"')
    client.send("Content-Length: 1", body=b"x")  # the connection goes on
    assert client.answer()[0] == 200


@limits(max_upload=MIB)
@pytest.mark.parametrize("expect", [(), ("Expect: 100-continue",)])
def test_a_length_over_the_limit_is_refused_before_a_byte_is_sent(connect, expect):
    client = connect()
    client.send(f"Content-Length: {MIB + 1}", *expect)
    assert client.problem() == (413, "too-large")


@limits(max_upload=MIB)
def test_chunks_over_the_limit_are_refused_in_the_midst(connect, store, tmp_path):
    client = connect()
    client.send("Transfer-Encoding: chunked")
    for _ in range(5):
        client.socket.sendall(b"40000\r\n" + b"x" * 0x40000 + b"\r\n")
    assert client.problem() == (413, "too-large")
    assert not is_left_behind(store, tmp_path)


@pytest.mark.parametrize(
    "broken",
    [
        b"zz\r\nx\r\n",
        b"4\r\nabcdefgh\r\n",
        b"-1\r\n",
        b"ffffffffffffffffffff\r\nx",
        b"1\r\nx\r\n\r\n",
    ],
)
def test_broken_chunks_leave_nothing_behind(connect, store, tmp_path, broken):
    client = connect()
    client.send("Transfer-Encoding: chunked", body=b"40000\r\n" + b"x" * 0x40000 + b"\r\n")
    until(lambda: list((tmp_path / "drafts").iterdir()))
    client.socket.sendall(broken)
    assert client.answer()[0] == 400
    until(lambda: not is_left_behind(store, tmp_path))


def test_a_client_that_goes_away_leaves_nothing_behind(connect, store, tmp_path):
    client = connect()
    client.send(f"Content-Length: {4 * MIB}", body=b"x" * 2 * MIB)
    until(lambda: list((tmp_path / "drafts").iterdir()))
    client.socket.close()
    until(lambda: not is_left_behind(store, tmp_path))


@limits(upload_idle_seconds=0.2)
def test_a_silent_client_is_told_and_sent_away(connect, store, tmp_path):
    client = connect()
    client.send("Content-Length: 1000000", body=b"x" * 500_000)
    assert client.problem() == (408, "upload-timeout")
    assert not is_left_behind(store, tmp_path)


@limits(upload_idle_seconds=5.0, min_upload_rate=1000)
def test_a_client_that_sends_byte_by_byte_is_sent_away(connect, store, tmp_path, monkeypatch):
    monkeypatch.setattr(body, "_GRACE", 0.2)
    client = connect()
    client.send("Content-Length: 1000000")
    client.socket.settimeout(0.02)
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        client.socket.sendall(b"x")
        try:
            client.socket.recv(1, socket.MSG_PEEK)
            break
        except TimeoutError:
            continue
    client.socket.settimeout(20)
    assert client.problem() == (408, "upload-timeout")
    assert not is_left_behind(store, tmp_path)


@pytest.fixture
def _many_files():
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4096)), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.usefixtures("_many_files")
def test_a_thousand_idle_uploads_hold_nobody_up(connect, store):
    for _ in range(1000):
        connect().send("Content-Length: 1000000", body=b"begun")
    data = b"passes" * MIB
    client = connect()
    begin = time.monotonic()
    client.send(f"Content-Length: {len(data)}", body=data)
    assert client.answer()[0] == 200
    assert time.monotonic() - begin < 5.0
    assert list(store.digests()) == [blob_of(data).digest]


def test_the_memory_of_the_server_does_not_grow_with_an_upload(tmp_path):
    """Its most is about 50 MiB, of which the interpreter and its modules are most."""
    command = [sys.executable, "-m", "tests.service.uploads.upload_server", str(tmp_path)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as process:
        with Connection(int(process.stdout.readline())) as client:
            client.send(f"Content-Length: {200 * MIB}")
            for _ in range(200):
                client.socket.sendall(b"x" * MIB)
            assert client.answer()[0] == 200
        most, _ = process.communicate("")
    assert int(most) < 100 * 1024
