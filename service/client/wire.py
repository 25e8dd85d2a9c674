"""The verbs of HTTP as this API uses them: JSON, files, pages and server-sent events."""

from __future__ import annotations

import re
import secrets
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import httpx

from service.client.sending import Sender
from service.client.transfers import ReportShare, Upload, download, report_as_read

_TIMEOUT = httpx.Timeout(60.0, connect=10.0, pool=None)
_SILENCE = httpx.Timeout(40.0, connect=10.0)  # a stream without even a comment counts as lost
_ANY_NUMBER = httpx.Limits(max_connections=None, max_keepalive_connections=20)
"""Of connections: each job that is followed has one of its own."""
_LOOPBACK = ("127.0.0.1", "localhost", "[::1]")

Query = Mapping[str, Any]
"""Parameters of an address or a form: None is left out, of a list each is given."""

# Not str.splitlines, which would also break lines where a name in the data holds U+2028.  A CR at
# the end of a chunk may be the first half of CR LF, so it waits for the next.
_LINE_END = re.compile(rb"\r\n|\n|\r(?!\Z)")


class Wire:
    """Requests to one server.

    What changes something has an ``Idempotency-Key``, so that all may be sent again.
    """

    def __init__(
        self, server: str, key: str | None, patience: float, stop: threading.Event
    ) -> None:
        self._http = httpx.Client(
            base_url=server,
            headers={"Authorization": f"Bearer {key}"} if key else {},
            timeout=_TIMEOUT,
            limits=_ANY_NUMBER,
            mounts={f"all://{host}": None for host in _LOOPBACK},  # never by a proxy
        )
        self._sender = Sender(self._http, patience, stop)
        self.pause = self._sender.pause

    def close(self) -> None:
        self._http.close()

    def get(self, path: str, query: Query | None = None) -> Any:
        # None, as an empty mapping takes away what the path itself asks for.
        return self._json("GET", path, params=_as_text(query) or None)

    def put(self, path: str, body: Mapping[str, Any]) -> Any:
        return self._json("PUT", path, json=body, headers=_fresh_key())

    def delete(self, path: str) -> None:
        key = _fresh_key()
        self._sender.send(lambda: self._http.build_request("DELETE", path, headers=key))

    def post(self, path: str, body: Mapping[str, Any] | None = None) -> Any:
        return self._json("POST", path, json=body, headers=_fresh_key())

    def post_body(self, path: str, upload: Upload, query: Query, tell: ReportShare) -> Any:
        """An upload as it is, read as it goes."""
        headers = {
            "Content-Type": "application/octet-stream",
            "Content-Length": str(upload.size),
            **_fresh_key(),
        }
        params = _as_text({**query, "filename": upload.name})

        def build() -> httpx.Request:
            chunks = report_as_read(upload.chunks(), upload.size, self._checking(tell))
            return self._http.build_request(
                "POST", path, params=params, content=chunks, headers=headers
            )

        return self._sender.send(build).json()

    def post_parts(
        self, path: str, uploads: Mapping[str, Upload], fields: Query, tell: ReportShare
    ) -> Any:
        """Post several uploads, read as they go, and fields of text before them."""
        key = _fresh_key()
        with ExitStack() as opened:

            def build() -> httpx.Request:
                files = {
                    part: (one.name, opened.enter_context(one.open()), one.media_type)
                    for part, one in uploads.items()
                }
                form = self._http.build_request(
                    "POST", path, data=_as_text(fields), files=files, headers=key
                )
                size = int(form.headers["Content-Length"])
                chunks = report_as_read(
                    cast(Iterable[bytes], form.stream), size, self._checking(tell)
                )
                return self._http.build_request("POST", path, headers=form.headers, content=chunks)

            return self._sender.send(build).json()

    def items(self, path: str, query: Query) -> Iterator[Any]:
        """The items of all pages; each is asked for when it is reached."""
        page = self.get(path, query)
        yield from page["items"]
        while page["next"]:
            page = self.get(page["next"])
            yield from page["items"]

    def events(self, path: str) -> Iterator[ServerEvent]:
        """Server-sent events; :class:`httpx.TransportError` where the stream breaks off."""

        def build() -> httpx.Request:
            return self._http.build_request(
                "GET", path, headers={"Accept": "text/event-stream"}, timeout=_SILENCE
            )

        with closing(self._sender.send(build, stream=True)) as response:
            yield from server_events(response.iter_bytes())

    def download(self, path: str, target: Path) -> None:
        download(self._sender, lambda: self._http.build_request("GET", path), target)

    def _json(self, verb: str, path: str, **more: Any) -> Any:
        return self._sender.send(lambda: self._http.build_request(verb, path, **more)).json()

    def _checking(self, tell: ReportShare) -> ReportShare:
        def report_unless_stopped(share: float) -> None:
            self._sender.check()
            tell(share)

        return report_unless_stopped


def _fresh_key() -> dict[str, str]:
    return {"Idempotency-Key": secrets.token_hex(16)}


def _as_text(query: Query | None) -> dict[str, Any]:
    """What is not None, as text that addresses and forms hold."""
    return {name: _text(value) for name, value in (query or {}).items() if value is not None}


def _text(value: Any) -> Any:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_text(one) for one in value]
    return str(value)


@dataclass(frozen=True)
class ServerEvent:
    """An event: its type, ``message`` where none was told, and its data, lines joined."""

    type: str
    data: str


def server_events(chunks: Iterable[bytes]) -> Iterator[ServerEvent]:
    """The events of a stream, however it was cut; one that the end breaks off is left out."""
    kind, data = "", list[str]()
    for line in _lines(chunks):
        if not line:
            if data:
                yield ServerEvent(kind or "message", "\n".join(data))
            kind, data = "", []
            continue
        field, _, value = line.partition(":")  # a comment is a field without a name
        value = value.removeprefix(" ")
        if field == "event":
            kind = value
        elif field == "data":
            data.append(value)


def _lines(chunks: Iterable[bytes]) -> Iterator[str]:
    rest = b""
    for chunk in chunks:
        *whole, rest = _LINE_END.split(rest + chunk)
        for line in whole:
            yield line.decode("utf-8", "replace")
