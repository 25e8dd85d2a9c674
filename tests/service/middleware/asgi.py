"""An application to surround, and requests to it without a network."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from starlette.types import ASGIApp, Message, Receive, Scope, Send


@dataclass
class Echo:
    """Answers every request with what it is told to, in some pieces; remembers their scopes."""

    headers: Mapping[str, str] = field(default_factory=lambda: {"content-type": "text/plain"})
    body: tuple[bytes, ...] = (b"done",)
    status: int = 200
    scopes: list[Scope] = field(default_factory=list)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.scopes.append(scope)
        raw = [(name.encode(), value.encode()) for name, value in self.headers.items()]
        await send({"type": "http.response.start", "status": self.status, "headers": raw})
        for number, piece in enumerate(self.body, 1):
            more = number < len(self.body)
            await send({"type": "http.response.body", "body": piece, "more_body": more})


@dataclass(frozen=True)
class Answer:
    """All that was sent."""

    messages: list[Message]

    @property
    def status(self) -> int:
        return self.messages[0]["status"]

    @property
    def headers(self) -> dict[str, str]:
        return {
            name.decode().lower(): value.decode() for name, value in self.messages[0]["headers"]
        }

    @property
    def body(self) -> bytes:
        return b"".join(one.get("body", b"") for one in self.messages[1:])


def ask(
    app: ASGIApp,
    path: str = "/v1/jobs",
    method: str = "GET",
    headers: Mapping[str, str] | list[tuple[str, str]] | None = None,
    **scope: Any,
) -> Answer:
    """One request, with a Host of localhost unless told; errors of the application pass through."""
    pairs = list((headers or {}).items()) if not isinstance(headers, list) else headers
    if not isinstance(headers, list) and "host" not in (headers or {}):
        pairs.append(("host", "localhost:8000"))
    asked: Scope = {
        "type": "http",
        "method": method,
        "scheme": "http",
        "path": path,
        "client": ("127.0.0.1", 50000),
        "headers": [(name.encode("latin-1"), value.encode("latin-1")) for name, value in pairs],
        **scope,
    }
    messages: list[Message] = []

    async def receive() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Message) -> None:
        messages.append(message)

    asyncio.run(app(asked, receive, send))  # type: ignore[arg-type]
    return Answer(messages)
