"""Routes whose JSON bodies are read into memory, and so must be small."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from fastapi import Request, Response
from fastapi.routing import APIRoute
from starlette.types import Message

from service.errors import TooLargeError

_LONGEST = 64 << 10


class SmallBodyRoute(APIRoute):
    """Reads no more of a body than a form of a few fields needs, however long it is said to be.

    Raises :class:`~service.errors.TooLargeError`.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        handle = super().get_route_handler()

        async def limited(request: Request) -> Response:
            return await handle(_replayed(request, await _short_body(request)))

        return limited


async def _short_body(request: Request) -> bytes:
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > _LONGEST:
            raise TooLargeError(
                f"the body has more than {_LONGEST:,} bytes",
                remedy="send only what /docs says",
                headers={"Connection": "close"},
            )
    return bytes(body)


def _replayed(request: Request, body: bytes) -> Request:
    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    return Request(request.scope, receive)
