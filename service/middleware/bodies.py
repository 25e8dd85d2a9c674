"""How bodies come in when there are many of them, and when one is refused.

When many clients post in the same moment, the event loop would do a step of each before it looks
at anything else, and a question that takes a millisecond would wait for all of them.  So few posts
at a time are taken from their headers to the point where their body is read or they are refused;
the others wait, which costs nothing.

A server that closes while a body still comes makes the kernel send a reset, and a client that has
not read the answer yet loses it.  So where one says ``Connection: close``, its last message waits
until the body has come, or as much of it as is worth waiting for (RFC 9112, section 9.6).
"""

from __future__ import annotations

import asyncio
from contextlib import suppress

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_AT_ONCE = 4

_LINGER_SECONDS = 2.0
_LINGER_BYTES = 16 << 20


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


class LingeringClose:
    """Reads on after a refusal, within limits, and throws away what comes."""

    def __init__(
        self, app: ASGIApp, *, seconds: float = _LINGER_SECONDS, most: int = _LINGER_BYTES
    ) -> None:
        self._app, self._seconds, self._most = app, seconds, most

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        coming, closing = True, False

        async def receive_noting() -> Message:
            nonlocal coming
            message = await receive()
            coming = message["type"] == "http.request" and message.get("more_body", False)
            return message

        async def drain() -> None:
            read = 0
            while coming and read < self._most:
                read += len((await receive_noting()).get("body", b""))

        async def send_lingering(message: Message) -> None:
            nonlocal closing
            if message["type"] == "http.response.start":
                closing = Headers(raw=message["headers"]).get("connection", "").lower() == "close"
            elif closing and coming and not message.get("more_body", False):
                await send({**message, "more_body": True})
                with suppress(TimeoutError):
                    await asyncio.wait_for(drain(), self._seconds)
                message = {"type": "http.response.body", "body": b""}
            await send(message)

        await self._app(scope, receive_noting, send_lingering)
