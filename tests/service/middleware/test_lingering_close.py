"""Answers that close their connection while a body still comes."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Awaitable, Callable
from urllib.parse import urlsplit

from starlette.types import Message, Receive, Scope, Send

from service.middleware.bodies import LingeringClose
from tests.service.middleware.asgi import Echo
from tests.service.routes.serving import listening

REFUSED = Echo(headers={"connection": "close", "content-length": "4"}, status=403)


class Body:
    """A body in pieces, of which it knows how many were asked for."""

    def __init__(self, pieces: int, size: int = 10) -> None:
        self.left, self.size = pieces, size

    async def __call__(self) -> Message:
        self.left -= 1
        return {"type": "http.request", "body": b"x" * self.size, "more_body": self.left > 0}


def messages(
    app: LingeringClose, receive: Callable[[], Awaitable[Message]], kind: str = "http"
) -> list[Message]:
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    asyncio.run(app({"type": kind, "headers": []}, receive, send))  # type: ignore[arg-type]
    return sent


def test_the_rest_of_a_body_is_read_before_the_last_message() -> None:
    body = Body(5)
    sent = messages(LingeringClose(REFUSED), body)
    assert body.left == 0
    assert [one.get("more_body") for one in sent[1:]] == [True, None]
    assert b"".join(one["body"] for one in sent[1:]) == b"done"


def test_no_more_of_it_is_read_than_is_worth_it() -> None:
    body = Body(1000, size=100)
    messages(LingeringClose(REFUSED, most=1000), body)
    assert body.left == 990


def test_a_client_that_stays_silent_is_waited_for_in_vain_and_not_long() -> None:
    async def silence() -> Message:
        await asyncio.sleep(60.0)
        raise AssertionError("waited to the end")

    sent = messages(LingeringClose(REFUSED, seconds=0.05), silence)
    assert sent[-1].get("more_body", False) is False


def test_answers_that_keep_the_connection_read_nothing() -> None:
    body = Body(5)
    messages(LingeringClose(Echo(status=401)), body)
    assert body.left == 5


def test_a_body_that_was_read_whole_is_not_asked_for_again() -> None:
    body = Body(2)

    async def reader(scope: Scope, receive: Receive, send: Send) -> None:
        while (await receive())["more_body"]:
            pass
        await REFUSED(scope, receive, send)

    assert len(messages(LingeringClose(reader), body)) == 2
    assert body.left == 0


def test_a_client_that_sends_all_before_it_reads_hears_why_it_was_refused() -> None:
    """Without lingering the kernel resets the connection under it."""
    pieces, size = 20, 200_000
    with listening(LingeringClose(REFUSED)) as address:
        place = urlsplit(address)
        with socket.create_connection((place.hostname, place.port), timeout=10.0) as client:
            head = f"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: {pieces * size}\r\n\r\n"
            client.sendall(head.encode())
            for _ in range(pieces):
                client.sendall(b"x" * size)
                time.sleep(0.005)  # longer than a server takes that does not wait
            assert client.makefile("rb").read().endswith(b"done")
