"""A name for every request, and a line in the log.

The line has no query and no headers: they may hold secrets.
"""

from __future__ import annotations

import logging
import re
import secrets
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.key import Caller
from service.headers import wait_seconds, wants_result
from service.logs import begin_request, request_id
from service.tracing import HEADER, SpanKind, span

_log = logging.getLogger("service.requests")

_UNTRACED = frozenset({"/healthz", "/readyz", "/metrics"})
"""What is asked for all the time, and takes none."""

_NAME = re.compile(r"[A-Za-z0-9._-]{1,64}", re.ASCII)


@dataclass
class _Answer:
    """What has been sent of an answer; ``announced`` are its bytes by ``Content-Length``."""

    status: int | None = None
    seconds: float = 0.0
    size: int = 0
    announced: int | None = None
    ended: bool = False

    @property
    def whole(self) -> bool:
        """Who has all that was announced may hang up before the answer's end is sent."""
        return self.ended or (self.announced is not None and self.size >= self.announced)


@dataclass(frozen=True)
class SentAnswer:
    """An answer as it is counted.

    ``route``    its template; None where no route was for it.
    ``seconds``  until it began; ``waited`` whether it was asked to wait for a job.
    """

    method: str
    route: str | None
    status: int
    seconds: float
    waited: bool


Observe = Callable[[SentAnswer], None]


class RequestLog:
    """Reads ``X-Request-Id`` or makes one, for the answer, the log and ``request.state``.

    ``observe``  hears of each answer that was begun.
    """

    def __init__(self, app: ASGIApp, observe: Observe = lambda answer: None) -> None:
        self._app, self._observe = app, observe

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        name = _name_of(scope)
        scope.setdefault("state", {})["request_id"] = name
        begin_request(name)
        answer = _Answer()

        async def noting(message: Message) -> None:
            if message["type"] == "http.response.start":
                answer.status, answer.seconds = message["status"], time.perf_counter() - began
                headers = MutableHeaders(scope=message)
                headers["X-Request-Id"] = name
                if length := headers.get("Content-Length"):
                    answer.announced = int(length)
            elif message["type"] == "http.response.body":
                answer.size += len(message.get("body", b""))
                answer.ended = not message.get("more_body", False)
            await send(message)

        began = time.perf_counter()
        told_trace = Headers(scope=scope).get(HEADER)
        try:
            if scope["path"] in _UNTRACED:
                await self._app(scope, receive, noting)
            else:
                with span(scope["method"], SpanKind.SERVER, told_trace) as part:
                    await self._app(scope, receive, noting)
                    part.update_name(f"{scope['method']} {_route_of(scope) or 'other'}")
                    part.set_attribute("http.response.status_code", answer.status or 0)
        finally:
            told = _fields(scope, answer, time.perf_counter() - began)
            _log.info(_line(told, answer), extra={"fields": told})
            if answer.status is not None:
                self._observe(
                    SentAnswer(
                        scope["method"], _route_of(scope), answer.status, answer.seconds,
                        _may_wait(scope),
                    )
                )  # fmt: skip


def _name_of(scope: Scope) -> str:
    """The caller's own name for it, unless it could break a line of the log."""
    told = Headers(scope=scope).get("x-request-id", "")
    return told if _NAME.fullmatch(told) else secrets.token_hex(8)


def _route_of(scope: Scope) -> str | None:
    """The template of the route that answered, known once it has."""
    path = getattr(scope.get("route"), "path", None)
    return path if isinstance(path, str) else None


def _may_wait(scope: Scope) -> bool:
    wishes = Headers(scope=scope).getlist("prefer")
    return wants_result(wishes) or wait_seconds(wishes, 1.0) > 0.0


def _fields(scope: Scope, answer: _Answer, seconds: float) -> dict[str, Any]:
    """What the line tells, by name."""
    caller = scope["state"].get("caller")
    return {
        "client": scope["client"][0] if scope.get("client") else None,
        "method": scope["method"],
        "path": quote(scope["path"]),
        "status": answer.status,
        "bytes": answer.size,
        "milliseconds": round(1000.0 * seconds, 1),
        "key": caller.key_id if isinstance(caller, Caller) else None,
        "whole": answer.whole,
    }


def _line(told: Mapping[str, Any], answer: _Answer) -> str:
    end = "" if answer.whole else " broken off"
    return (
        f"{told['client'] or '-'} {told['method']} {told['path']} {answer.status or '-'} "
        f"{answer.size} bytes {told['milliseconds']:.1f} ms key={told['key'] or '-'} "
        f"id={request_id()}{end}"
    )
