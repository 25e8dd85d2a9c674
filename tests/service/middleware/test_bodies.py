"""How bodies come in when there are many of them, and when one is refused."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Awaitable, Callable
from urllib.parse import urlsplit

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.middleware.bodies import LingeringClose, Turnstile
from tests.service.middleware.asgi import Echo
from tests.service.routes.serving import listening


class Hall:
    """Counts who is inside; everybody waits for a word before reading or answering."""

    def __init__(self, *, reads: bool) -> None:
        self.reads = reads
        self.inside = self.most = self.reading = 0
        self.word = asyncio.Event()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.inside += 1
        self.most = max(self.most, self.inside)
        if scope["method"] == "POST" and not self.reads:
            await self.word.wait()
        self.inside -= 1
        if self.reads:
            self.reading += 1
            await receive()
        await send({"type": "http.response.start", "status": 204, "headers": []})


async def silence() -> Message:
    await asyncio.Event().wait()
    raise AssertionError("unreachable")


async def ignored(message: Message) -> None:
    del message


def scope(method: str) -> Scope:
    return {"type": "http", "method": method}


def test_few_with_bodies_are_let_in_at_a_time_and_all_in_the_end() -> None:
    async def crowd() -> Hall:
        hall = Hall(reads=False)
        gate = Turnstile(hall, at_once=3)
        posts = [asyncio.create_task(gate(scope("POST"), silence, ignored)) for _ in range(10)]
        await asyncio.sleep(0)
        await gate(scope("GET"), silence, ignored)  # passes by them
        assert hall.most <= 4
        hall.word.set()
        await asyncio.gather(*posts)
        return hall

    assert asyncio.run(crowd()).inside == 0


def test_who_reads_a_body_makes_room_for_others() -> None:
    """However slowly it comes."""

    async def crowd() -> int:
        hall = Hall(reads=True)
        gate = Turnstile(hall, at_once=1)
        posts = [asyncio.create_task(gate(scope("POST"), silence, ignored)) for _ in range(5)]
        for _ in range(20):
            await asyncio.sleep(0)
        for post in posts:
            post.cancel()
        return hall.reading

    assert asyncio.run(crowd()) == 5


@pytest.mark.parametrize("fault", [RuntimeError, asyncio.CancelledError])
def test_who_fails_inside_makes_room_too(fault: type[BaseException]) -> None:
    async def broken(scope: Scope, receive: Receive, send: Send) -> None:
        raise fault

    async def crowd() -> None:
        gate = Turnstile(broken, at_once=1)
        for _ in range(3):
            with pytest.raises(fault):
                await asyncio.wait_for(gate(scope("POST"), silence, ignored), 1.0)

    asyncio.run(crowd())


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
