"""A name for every request, and a line in the log.

The line has no query and no headers: they may hold secrets.
"""

from __future__ import annotations

import logging
import re
import secrets
import time
from dataclasses import dataclass
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.key import Caller

_log = logging.getLogger("service.requests")

_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}", re.ASCII)


@dataclass
class _Answer:
    """What has been sent of an answer."""

    status: int | None = None
    size: int = 0
    whole: bool = False


class RequestLog:
    """Reads ``X-Request-Id`` or makes one, for the answer, the log and ``request.state``."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        name = _name_of(scope)
        scope.setdefault("state", {})["request_id"] = name
        answer = _Answer()

        async def noting(message: Message) -> None:
            if message["type"] == "http.response.start":
                answer.status = message["status"]
                MutableHeaders(scope=message)["X-Request-Id"] = name
            elif message["type"] == "http.response.body":
                answer.size += len(message.get("body", b""))
                answer.whole = not message.get("more_body", False)
            await send(message)

        began = time.perf_counter()
        try:
            await self._app(scope, receive, noting)
        finally:
            _log.info(_line(scope, answer, time.perf_counter() - began))


def _name_of(scope: Scope) -> str:
    """The caller's own name for it, unless it could break a line of the log."""
    told = Headers(scope=scope).get("x-request-id", "")
    return told if _NAME.fullmatch(told) else secrets.token_hex(8)


def _line(scope: Scope, answer: _Answer, seconds: float) -> str:
    state = scope["state"]
    address = scope["client"][0] if scope.get("client") else "-"
    caller = state.get("caller")
    key = caller.key_id if isinstance(caller, Caller) and caller.key_id else "-"
    end = "" if answer.whole else " broken off"
    return (
        f"{address} {scope['method']} {quote(scope['path'])} {answer.status or '-'} "
        f"{answer.size} bytes {1000.0 * seconds:.1f} ms key={key} id={state['request_id']}{end}"
    )
