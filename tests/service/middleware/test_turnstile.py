"""Who goes first when many come at once."""

from __future__ import annotations

import asyncio

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.middleware.bodies import Turnstile


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
