"""The body of a request as it comes, within limits on its size and on the client's slowness.

Uploads are read in chunks; JSON bodies are read into memory, and so must be small.
"""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from typing import Any

from fastapi import Response
from fastapi.routing import APIRoute
from starlette.requests import Request
from starlette.types import Message

from service.errors import TooLargeError, UnsupportedMediaTypeError, UploadTimeoutError
from service.settings import Settings

_GRACE = 60.0
"""Seconds before the rate of an upload counts."""

_SMALL = 64 << 10
_SMALL_SECONDS = 20.0


class Body:
    """A body, to be read once.  ``ended`` says whether all of it was."""

    def __init__(self, request: Request, settings: Settings) -> None:
        """Look at what is told beforehand.

        Raises :class:`TooLargeError`, and :class:`UnsupportedMediaTypeError` for what is packed: a
        small body could unpack to any size.
        """
        self.ended = False
        self._request = request
        self._settings = settings
        packed = request.headers.get("content-encoding", "identity")
        if packed.strip().lower() != "identity":
            raise UnsupportedMediaTypeError(
                f"the content encoding '{packed}' is not unpacked here",
                remedy="send the file as it is, without Content-Encoding",
                headers={"Accept-Encoding": "identity"},
            )
        self._check_size(int(request.headers.get("content-length", 0)))

    async def chunks(self) -> AsyncIterator[bytes]:
        """Raises :class:`TooLargeError`, :class:`UploadTimeoutError` and ClientDisconnect.

        Only the time spent waiting for the client is held against it.
        """
        stream, size, waited = self._request.stream(), 0, 0.0
        while True:
            begin = time.monotonic()
            try:
                async with asyncio.timeout(self._settings.upload_idle_seconds):
                    chunk = await anext(stream)
            except StopAsyncIteration:
                break
            except TimeoutError:
                raise UploadTimeoutError(
                    f"nothing came for {self._settings.upload_idle_seconds:g} seconds, "
                    f"after {size:,} bytes",
                    remedy="send again without pauses",
                ) from None
            waited += time.monotonic() - begin
            size += len(chunk)
            self._check_size(size)
            self._check_rate(size, waited)
            if chunk:
                yield chunk
        self.ended = True

    def _check_size(self, size: int) -> None:
        if size > self._settings.max_upload:
            raise TooLargeError(
                f"an upload may have {self._settings.max_upload:,} bytes, and this one has more",
                remedy="send a smaller mesh, or a binary format in place of a textual one",
            )

    def _check_rate(self, size: int, waited: float) -> None:
        rate = self._settings.min_upload_rate
        if waited > _GRACE and size < rate * waited:
            raise UploadTimeoutError(
                f"{size:,} bytes came in {waited:.0f} seconds, less than {rate:,} a second",
                remedy="send again over a faster line",
            )


class SmallBodyRoute(APIRoute):
    """Reads no more of a body than a form of a few fields needs, however long it is said to be,
    and for no longer.  Its SHA-256 is ``request.state.body_digest``.

    Raises :class:`~service.errors.TooLargeError` and :class:`~service.errors.UploadTimeoutError`.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        handle = super().get_route_handler()

        async def handle_small_body(request: Request) -> Response:
            try:
                async with asyncio.timeout(_SMALL_SECONDS):
                    body = await _short_body(request)
            except TimeoutError:
                raise UploadTimeoutError(
                    f"the body did not come within {_SMALL_SECONDS:g} seconds",
                    remedy="send again without pauses",
                    headers={"Connection": "close"},
                ) from None
            request.state.body_digest = hashlib.sha256(body).hexdigest()
            return await handle(_request_with(request, body))

        return handle_small_body


async def _short_body(request: Request) -> bytes:
    body = bytearray()
    async for chunk in request.stream():
        body += chunk
        if len(body) > _SMALL:
            raise TooLargeError(
                f"the body has more than {_SMALL:,} bytes",
                remedy="send only what /docs says",
                headers={"Connection": "close"},
            )
    return bytes(body)


def _request_with(request: Request, body: bytes) -> Request:
    async def receive() -> Message:
        return {"type": "http.request", "body": body, "more_body": False}

    return Request(request.scope, receive)
