"""Connections that never get to ask anything."""

from __future__ import annotations

import asyncio

import pytest
import uvicorn

from service.cli import server as protocol


async def hello(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"hello"})


@pytest.fixture
def talk(monkeypatch):
    """``talk(*pieces)``: what is answered to pieces of a request sent 0.1 seconds apart."""
    monkeypatch.setattr(protocol, "_HEADER_SECONDS", 0.25)

    async def exchange(pieces):
        config = uvicorn.Config(
            hello, http=protocol.HttpProtocol, port=0, lifespan="off", log_config=None
        )
        server = uvicorn.Server(config)
        serving = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for piece in pieces:
            writer.write(piece)
            await asyncio.sleep(0.1)
        answer = await asyncio.wait_for(reader.read(65536), 5)
        writer.close()
        server.should_exit = True
        await serving
        return answer

    return lambda *pieces: asyncio.run(exchange(pieces))


def test_a_quick_request_is_answered(talk):
    assert b"hello" in talk(b"GET / HTTP/1.1\r\n", b"Host: x\r\n\r\n")


@pytest.mark.parametrize(
    "pieces", [(), (b"GET / HTTP/1.1\r\n", b"A: b\r\n", b"C: d\r\n", b"E: f\r\n")]
)
def test_a_slow_one_is_hung_up_on(talk, pieces):
    assert talk(*pieces) == b""
