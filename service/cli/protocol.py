"""HTTP as uvicorn speaks it, with an end to connections that never get to ask anything.

uvicorn watches the pauses between requests only: whoever opens a connection and sends a header a
minute would keep it for ever.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

_HEADERS = 20.0  # seconds from the first byte of a request, or the connection, to its last header


class HttpProtocol(HttpToolsProtocol):
    """Closes a connection whose request line and headers take too long."""

    def __init__(self, *settings: Any, **more: Any) -> None:
        super().__init__(*settings, **more)
        self._patience: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._begin_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        self._end_waiting()
        super().connection_lost(exc)

    def on_message_begin(self) -> None:
        self._begin_waiting()
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        self._end_waiting()
        super().on_headers_complete()

    def _begin_waiting(self) -> None:
        self._end_waiting()
        self._patience = self.loop.call_later(_HEADERS, self.transport.close)

    def _end_waiting(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None
