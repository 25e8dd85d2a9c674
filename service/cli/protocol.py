"""HTTP on one connection: how much may come before there is a request, and how long things take.

uvicorn bounds neither the head of a request nor the time that an answer may lie unread, and its
parser joins the pieces of a header by copying all of them again.  What is counted here is what
comes in and is no body: the head, and what surrounds the pieces of a chunked body.
"""

from __future__ import annotations

import asyncio
import fcntl
import logging
import struct
import sys
import termios
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

from service.answers.problems import ProblemResponse
from service.errors import BadRequestError, HeadersTooLargeError, ServiceError

_LINGER_SECONDS = 2.0
_LINGER_BYTES = 1 << 20
"""What still comes after a refusal is thrown away within these, so that the refusal is read."""

_log = logging.getLogger("service.requests")


class Hangup(StrEnum):
    """Why the server ended a connection."""

    HEADERS_TOO_LARGE = "headers-too-large"
    HEADERS_TOO_SLOW = "headers-too-slow"
    DOWNLOAD_STALLED = "download-stalled"


@dataclass(frozen=True)
class ConnectionLimits:
    """What a connection may take.

    ``head_bytes``        of a request line and its headers, or of what follows a chunked body.
    ``head_fields``       headers of a request: each is looked through more than once.
    ``head_seconds``      from the first byte of a request, or the connection, to its last header.
    ``download_seconds``  for which a client may take nothing of an answer.
    """

    head_bytes: int = 64 << 10
    head_fields: int = 200
    head_seconds: float = 20.0
    download_seconds: float = 30.0


class HttpProtocol(HttpToolsProtocol):
    """One connection, which is ended where it goes beyond its limits.

    ``on_hangup``  is told why.
    """

    def __init__(
        self,
        *settings: Any,
        limits: ConnectionLimits | None = None,
        on_hangup: Callable[[Hangup], object] = lambda reason: None,
        **more: Any,
    ) -> None:
        super().__init__(*settings, **more)
        self._limits = limits or ConnectionLimits()
        self._on_hangup = on_hangup
        self._unclaimed = 0  # bytes since a head began or the last ones of a body
        self._refusal: ServiceError | None = None
        self._patience: asyncio.TimerHandle | None = None
        self._watch: asyncio.TimerHandle | None = None

    # What comes in

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._begin_waiting()

    def connection_lost(self, exc: Exception | None) -> None:
        self._end_waiting()
        if self._watch is not None:
            self._watch.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Hand on no more at once than may still come, so that the parser never holds more."""
        if self._refusal is not None:
            self._throw_away(len(data))
            return
        rest = memoryview(data)
        while rest and self._listens():
            piece = rest[: self._limits.head_bytes - self._unclaimed]
            rest = rest[len(piece) :]
            self._unclaimed += len(piece)
            super().data_received(bytes(piece))
            if self._unclaimed >= self._limits.head_bytes and self._listens():
                self._refuse(_too_large(f"{self._limits.head_bytes:,} bytes"))

    def _throw_away(self, size: int) -> None:
        self._unclaimed += size
        if self._unclaimed > _LINGER_BYTES:
            self.transport.pause_reading()

    def _listens(self) -> bool:
        """Whether what comes is still read: not after a refusal, an upgrade, or the end."""
        ours = self.transport.get_protocol() is self and not self.transport.is_closing()
        return ours and self._refusal is None

    def on_message_begin(self) -> None:
        self._begin_waiting()
        super().on_message_begin()

    def on_header(self, name: bytes, value: bytes) -> None:
        if len(self.headers) >= self._limits.head_fields:
            # The parser ends by it, and send_400_response finds out why.
            raise _too_large(f"{self._limits.head_fields} headers")
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        self._end_waiting()
        self._unclaimed = 0
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        self._unclaimed = 0
        super().on_body(body)

    def on_message_complete(self) -> None:
        self._unclaimed = 0
        super().on_message_complete()

    def _begin_waiting(self) -> None:
        self._end_waiting()
        self._patience = self.loop.call_later(self._limits.head_seconds, self._lose_patience)

    def _end_waiting(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None

    def _lose_patience(self) -> None:
        if self._unclaimed > 0:  # browsers open connections that they may not need
            self._on_hangup(Hangup.HEADERS_TOO_SLOW)
        self.transport.close()

    # What is no request

    def send_400_response(self, msg: str) -> None:
        """What uvicorn calls as it handles the error by which the parser ended."""
        error = sys.exception()
        if error is not None and isinstance(error.__context__, HeadersTooLargeError):
            self._refuse(error.__context__)
        else:
            what_is_wrong = "this is no request of HTTP/1.1"
            self._refuse(BadRequestError(what_is_wrong, remedy="check what sends it"))

    def _refuse(self, refusal: ServiceError) -> None:
        """Answer, and hang up soon after."""
        self._refusal = refusal
        self._end_waiting()
        if isinstance(refusal, HeadersTooLargeError):
            self._on_hangup(Hangup.HEADERS_TOO_LARGE)
        address = self.client[0] if self.client else "-"
        _log.info("%s refused before it was a request: %s", address, refusal.detail)
        if not self._is_answering():
            self.transport.write(_raw(refusal, self.server_state.default_headers))
            self.transport.write_eof()
            self._forget_request()
        self.loop.call_later(_LINGER_SECONDS, self.transport.abort)

    def _is_answering(self) -> bool:
        """Whether an answer to an earlier request is under way, into which nothing may come."""
        now = self.cycle
        return bool(self.pipeline) or (
            now is not None and now.response_started and not now.response_complete
        )

    def _forget_request(self) -> None:
        """Tell the application that nobody reads an answer to what has come of a request."""
        if self.cycle is not None and not self.cycle.response_complete:
            self.cycle.disconnected = True
            self.cycle.message_event.set()

    # What goes out

    def pause_writing(self) -> None:
        super().pause_writing()
        self._watch_writing()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._watch_writing()

    def _watch_writing(self) -> None:
        if self._watch is None and self.transport.get_write_buffer_size() > 0:
            self._look_again_after(self._untaken())

    def _look_again_after(self, untaken: int) -> None:
        self._watch = self.loop.call_later(self._limits.download_seconds, self._look, untaken)

    def _look(self, untaken_before: int) -> None:
        """End the connection if nothing was taken since the last look.

        While the client takes nothing, nothing is added either: the answer waits.
        """
        self._watch = None
        if self.transport.get_write_buffer_size() == 0:
            return
        untaken = self._untaken()
        if untaken != untaken_before:
            self._look_again_after(untaken)
            return
        self._on_hangup(Hangup.DOWNLOAD_STALLED)
        # Not close, which would wait for the client to take the rest.
        self.transport.abort()

    def _untaken(self) -> int:
        """Bytes of answers that the client has not acknowledged: here and in the system."""
        waiting = self.transport.get_write_buffer_size()
        connection = self.transport.get_extra_info("socket")
        try:
            told = fcntl.ioctl(connection.fileno(), termios.TIOCOUTQ, bytes(4))
        except OSError:  # not every system tells
            return waiting
        return waiting + int(struct.unpack("i", told)[0])


def _too_large(most: str) -> HeadersTooLargeError:
    return HeadersTooLargeError(
        f"the request line and the headers have more than {most}",
        remedy="send fewer or shorter headers",
    )


def _raw(refusal: ServiceError, headers: list[tuple[bytes, bytes]]) -> bytes:
    """A whole answer, for where there is no request to answer."""
    answer = ProblemResponse(refusal, "")
    lines = [*headers, *answer.raw_headers, (b"connection", b"close")]
    head = b"".join(name + b": " + value + b"\r\n" for name, value in lines)
    return STATUS_LINE[refusal.status] + head + b"\r\n" + bytes(answer.body)
