"""Lets those who ask for the state of things pass by a crowd that brings work.

When many clients post in the same moment, the event loop would do a step of each before it looks
at anything else, and a question that takes a millisecond would wait for all of them.  So few posts
at a time are taken from their headers to the point where their body is read or they are refused;
the others wait, which costs nothing.
"""

from __future__ import annotations

import asyncio

from starlette.types import ASGIApp, Message, Receive, Scope, Send

_AT_ONCE = 4


class Turnstile:
    """Lets in a few requests with bodies at a time, and any number without."""

    def __init__(self, app: ASGIApp, at_once: int = _AT_ONCE) -> None:
        self._app = app
        self._places = asyncio.Semaphore(at_once)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or scope["method"] in ("GET", "HEAD", "OPTIONS"):
            await self._app(scope, receive, send)
            return
        inside = False

        def leave() -> None:
            nonlocal inside
            if inside:
                inside = False
                self._places.release()

        async def read() -> Message:
            leave()
            return await receive()

        async def answer(message: Message) -> None:
            leave()
            await send(message)

        await self._places.acquire()
        inside = True
        try:
            await self._app(scope, read, answer)
        finally:
            leave()
