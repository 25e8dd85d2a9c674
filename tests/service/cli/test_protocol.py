"""Connections that ask too much, too slowly, or nothing at all."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from contextlib import suppress
from functools import partial

import pytest

from service.cli.protocol import ConnectionLimits, Hangup, HttpProtocol
from tests.service.routes.serving import listening

HOST = b"GET / HTTP/1.1\r\nHost: x\r\n"
LARGE = 64 << 20


async def hello(scope, receive, send):
    """Answers with what was sent, but for headers; /large with more than any buffer holds."""
    body, more = b"hello", True
    while more:
        message = await receive()
        body, more = body + message["body"], message["more_body"]
    size = LARGE if scope["path"] == "/large" else len(body)
    length = (b"content-length", str(size).encode())
    await send({"type": "http.response.start", "status": 200, "headers": [length]})
    for _ in range(size >> 20):
        await send({"type": "http.response.body", "body": bytes(1 << 20), "more_body": True})
    rest = body if size < LARGE else b""
    await send({"type": "http.response.body", "body": rest})


@pytest.fixture(scope="module")
def server():
    """The port of a server with short limits, and the list of its hang-ups."""
    hangups = []
    limits = ConnectionLimits(head_seconds=0.25, download_seconds=0.2)
    protocol = partial(HttpProtocol, limits=limits, on_hangup=hangups.append)
    with listening(hello, http=protocol, lifespan="off", log_config=None) as address:
        yield int(address.rpartition(":")[2]), hangups


@pytest.fixture
def port(server):
    return server[0]


@pytest.fixture
def hangups(server):
    server[1].clear()
    return server[1]


@pytest.fixture
def talk(port):
    """``talk(*pieces)``: what is answered to pieces of a request sent ``pause`` seconds apart."""

    async def exchange(pieces, pause):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        answer = asyncio.create_task(reader.read())
        with suppress(ConnectionError):
            for piece in pieces:
                writer.write(piece)
                await writer.drain()
                await asyncio.sleep(pause)
        try:
            return await asyncio.wait_for(answer, 5)
        finally:
            writer.close()

    return lambda *pieces, pause=0.0: asyncio.run(exchange(pieces, pause))


def head_of(size):
    """A whole head of so many bytes."""
    rest = b"Connection: close\r\n\r\n"
    return HOST + b"X: " + b"y" * (size - len(HOST) - len(rest) - 5) + b"\r\n" + rest


def problem_in(answer, status):
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 %d " % status), head
    assert b"content-type: application/problem+json" in head.lower()
    assert b"connection: close" in head.lower()
    problem = json.loads(body)
    assert problem["status"] == status
    return problem


def test_a_quick_request_is_answered(talk):
    first = b"GET / HTTP/1.1\r\nConnection: close\r\n"
    assert b"hello" in talk(first, b"Host: x\r\n\r\n", pause=0.1)


@pytest.mark.parametrize(
    ("pieces", "reasons"),
    [
        ((), []),
        ((b"GET / HTTP/1.1\r\n", *[b"A: b\r\n"] * 3), [Hangup.HEADERS_TOO_SLOW]),
    ],
)
def test_a_slow_one_is_hung_up_on(talk, hangups, pieces, reasons):
    assert not talk(*pieces, pause=0.1)
    assert hangups == reasons


def test_a_head_of_64_kib_is_read_and_one_of_a_byte_more_is_refused(talk, hangups):
    assert b"hello" in talk(head_of(64 << 10))
    assert hangups == []
    problem = problem_in(talk(head_of((64 << 10) + 1)), 431)
    assert problem["type"] == "/problems/headers-too-large"
    assert hangups == [Hangup.HEADERS_TOO_LARGE]


@pytest.mark.parametrize(
    "endless",
    [
        pytest.param((HOST + b"X: ", b"y" * 65536), id="value"),
        pytest.param((HOST, b"y" * 65536), id="name"),
        pytest.param((b"GET /", b"y" * 65536), id="address"),
        pytest.param((HOST, b"X: y\r\n" * 10_000), id="fields"),
        pytest.param(
            (b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n0\r\nX: ",
             b"y" * 65536),
            id="trailer",
        ),
        pytest.param(
            (b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n1;", b"y" * 65536),
            id="chunk",
        ),
    ],
)  # fmt: skip
def test_what_never_ends_is_refused_before_it_is_kept(talk, hangups, endless):
    first, more = endless
    problem_in(talk(first, *[more] * 20), 431)
    assert hangups == [Hangup.HEADERS_TOO_LARGE]


def test_headers_of_one_request_do_not_count_for_the_next(talk):
    one = head_of(40 << 10).replace(b"Connection: close", b"X-Other: x")
    assert talk(one, one, head_of(40 << 10)).count(b"hello") == 3


def test_a_body_is_no_header(talk):
    size = 3 << 20
    head = b"POST / HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % size
    assert len(talk(head, *[bytes(1 << 19)] * 6)) > size


@pytest.mark.parametrize(
    "sent",
    [
        b"no request\r\n\r\n",
        b"GET / HTTP/9.9\r\nHost: x\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: x\r\nbad header\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
        b"GET \xff\xfe HTTP/1.1\r\nHost: x\r\n\r\n",
    ],
)
def test_what_is_no_request_is_told_so(talk, sent):
    assert problem_in(talk(sent), 400)["type"] == "/problems/bad-request"


@pytest.mark.parametrize("taken", [0, 1 << 16])
def test_a_download_that_stalls_is_ended_and_one_that_is_slow_is_not(port, hangups, taken):
    """``taken`` each twentieth of a second, for more than the time that nothing may be."""
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
        connection.connect(("127.0.0.1", port))
        connection.sendall(b"GET /large HTTP/1.1\r\nHost: x\r\n\r\n")
        for _ in range(20):
            time.sleep(0.05)
            connection.recv(taken)
    assert hangups == ([] if taken else [Hangup.DOWNLOAD_STALLED])
