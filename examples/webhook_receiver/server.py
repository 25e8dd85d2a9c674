"""The HTTP side: what comes is short, signed and fresh, or nothing is done with it."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from service.webhooks.signing import SignatureError, verify

LARGEST = 1 << 20
"""Bytes of a word; a job takes a few thousand."""

_SILENCE = 10.0  # seconds
_RETRY_AFTER = 5  # seconds

_log = logging.getLogger("webhook_receiver")

Receive = Callable[[Mapping[str, Any]], None]
"""Does what a word asks for.  Raises :class:`TryLaterError`."""


class TryLaterError(Exception):
    """Nothing came of a word, and the same one may do better later."""


def make_server(host: str, port: int, secret: str, receive: Receive) -> ThreadingHTTPServer:
    """A server whose answers are 2xx only once a word is dealt with: others are sent again."""

    class Handler(BaseHTTPRequestHandler):
        timeout = _SILENCE

        def do_POST(self) -> None:
            status = self._status()
            self.send_response(status)
            if status is HTTPStatus.SERVICE_UNAVAILABLE:
                self.send_header("Retry-After", str(_RETRY_AFTER))
            self.send_header("Content-Length", "0")
            self.end_headers()

        def _status(self) -> HTTPStatus:
            length = self.headers.get("Content-Length", "")
            if not (length.isascii() and length.isdecimal()):
                return HTTPStatus.LENGTH_REQUIRED
            if len(length) > len(str(LARGEST)) or int(length) > LARGEST:
                return HTTPStatus.REQUEST_ENTITY_TOO_LARGE
            body = self.rfile.read(int(length))
            try:
                verify(secret, self.headers, body)
                receive(json.loads(body))
            except SignatureError as error:
                _log.warning("refused: %s", error)
                return HTTPStatus.UNAUTHORIZED
            except TryLaterError as error:
                _log.warning("not now: %s", error)
                return HTTPStatus.SERVICE_UNAVAILABLE
            return HTTPStatus.NO_CONTENT

        def log_message(self, format: str, *values: object) -> None:
            _log.debug(format, *values)

    return ThreadingHTTPServer((host, port), Handler)
