"""Requests that are sent again where that helps: a lost connection, a full queue, a restart."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable

import httpx

from service.client.errors import StoppedError, no_answer, refusal
from service.errors import RequestUnderWayError
from service.headers import retry_after

_LATER = (429, 503)
_CONNECTIONS = 6  # tries in a row that get no answer: six seconds
_FIRST_DELAY = 0.2  # seconds, doubled from try to try
_LONGEST_DELAY = 30.0
_SPREAD = 0.2  # seconds, so that those who were told the same do not come at once

Build = Callable[[], httpx.Request]
"""Makes the request of one try, with a body that is at its begin."""


class Sender:
    """Sends requests of which a second copy does no harm.

    ``patience``  seconds for which an answer "later" (429, 503, or 409 while the first copy is
                  still being worked on) is followed by another try.
    ``stop``      once set, from any thread, ends waiting by :class:`StoppedError`.
    """

    def __init__(self, http: httpx.Client, patience: float, stop: threading.Event) -> None:
        self._http, self._patience, self._stop = http, patience, stop

    def send(self, build: Build, *, stream: bool = False) -> httpx.Response:
        """The answer, if it is no refusal; with ``stream`` its body is still to be read.

        Raises :class:`~service.client.errors.ClientError`.
        """
        begin, lost, later = time.monotonic(), 0, 0
        while True:
            self.check()
            try:
                response = self._http.send(build(), stream=True)
                if not (stream and response.is_success):
                    response.read()
            except httpx.TransportError as error:
                lost += 1
                if lost == _CONNECTIONS or isinstance(error, httpx.UnsupportedProtocol):
                    raise no_answer(str(self._http.base_url), error) from error
                self.pause(_backoff(lost))
                continue
            if response.is_success:
                return response
            lost, later = 0, later + 1
            delay = _delay(response, later)
            patient = time.monotonic() - begin + delay <= self._patience
            refused = refusal(response)
            # The server has not seen yet that the line of the first try is lost.
            under_way = refused.problem.slug == RequestUnderWayError.slug
            if not (under_way or response.status_code in _LATER) or not patient:
                raise refused
            self.pause(delay)

    def check(self) -> None:
        if self._stop.is_set():
            raise StoppedError

    def pause(self, seconds: float) -> None:
        """Wait, unless the caller wants to stop."""
        self._stop.wait(seconds)
        self.check()


def _backoff(tries: int) -> float:
    """Doubled from try to try; partly by chance, so that many clients do not come back at once."""
    return min(_FIRST_DELAY * 2.0 ** (tries - 1), _LONGEST_DELAY) * random.uniform(0.5, 1.0)


def _delay(response: httpx.Response, tries: int) -> float:
    """Seconds to wait, as the server says where it does."""
    said = retry_after(response.headers.get("Retry-After"), time.time())
    if said is None:
        return _backoff(tries)
    return max(0.0, said) + random.uniform(0.0, _SPREAD)
