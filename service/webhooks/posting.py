"""One try to tell one receiver, by a connection to an address that was judged; and when the next
is due.
"""

from __future__ import annotations

import asyncio
import random
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import ip_address

import httpx

from service.headers import retry_after
from service.webhooks.address_guard import (
    Resolve,
    UnsafeAddressError,
    fault_of,
    safe_addresses,
    target_of,
)
from service.webhooks.excerpt import MAY_BE_SHOWN, excerpt_of

_READ_BYTES = 4096
_READ_SECONDS = 1.0
_CONNECT_SHARE = 0.25  # of the time, so that another address gets its turn

LONGEST_WAIT = 3600.0
_FIRST_WAIT = 10.0
_WAIT_FACTOR = 3.0
_WAIT_JITTER = 0.2  # so that what failed together does not come back together
_MOST_ADDRESSES = 4


@dataclass(frozen=True)
class PostOutcome:
    """What came of a try.

    ``reason``  why it was not heard; empty when it was.
    ``gone``    the receiver wants no more of it.
    ``wait``    seconds that the receiver asks for before the next try.
    ``status``  that it answered with; ``excerpt`` of its answer, where that may be shown.
    """

    reason: str = ""
    gone: bool = False
    wait: float | None = None
    status: int | None = None
    excerpt: str | None = None

    @property
    def heard(self) -> bool:
        return not self.reason


async def post_webhook(
    transport: httpx.AsyncBaseTransport,
    url: str,
    headers: Mapping[str, str],
    body: bytes,
    seconds: float,
) -> PostOutcome:
    """POST a body; any status of 200 to 299 is a yes.  Redirects are not followed."""
    try:
        async with asyncio.timeout(seconds):
            response = await _post(transport, url, headers, body, seconds)
    except (TimeoutError, httpx.TimeoutException):
        return PostOutcome(f"no answer within {seconds:g} seconds")
    except socket.gaierror:
        return PostOutcome("the host has no public address")
    except UnsafeAddressError as error:
        return PostOutcome(str(error))
    except (httpx.HTTPError, httpx.InvalidURL, OSError) as error:
        # By its kind alone: the words of the system may name addresses.
        return PostOutcome(f"the receiver could not be told ({type(error).__name__})")
    try:
        beginning = await _read_a_little(response)
    finally:
        await response.aclose()
    return _outcome_of(response, excerpt_of(response, beginning))


async def _post(
    transport: httpx.AsyncBaseTransport,
    url: str,
    headers: Mapping[str, str],
    body: bytes,
    seconds: float,
) -> httpx.Response:
    timeout = httpx.Timeout(seconds, connect=seconds * _CONNECT_SHARE)
    request = httpx.Request(
        "POST", url, headers=headers, content=body, extensions={"timeout": timeout.as_dict()}
    )
    return await transport.handle_async_request(request)


async def _read_a_little(response: httpx.Response) -> bytes:
    """The beginning; read also so that a receiver that still writes meets no closed connection.

    The status has said all that counts, so it does not matter how this ends.
    """
    beginning = b""
    with suppress(TimeoutError, httpx.HTTPError):
        async with asyncio.timeout(_READ_SECONDS):
            async for piece in response.aiter_raw():
                beginning += piece
                if len(beginning) > _READ_BYTES:
                    break
    return beginning[:_READ_BYTES]


def _outcome_of(response: httpx.Response, excerpt: str | None) -> PostOutcome:
    if response.is_success:
        return PostOutcome(status=response.status_code, excerpt=excerpt)
    return PostOutcome(
        f"the receiver answered {response.status_code}",
        status=response.status_code,
        excerpt=excerpt,
        gone=response.status_code == httpx.codes.GONE,
        wait=retry_after(response.headers.get("retry-after"), time.time()),
    )


def seconds_until_retry(tried: int, asked: float | None) -> float:
    """How long to wait after so many tries; what the receiver asks for counts, up to an hour."""
    if asked is not None:
        return min(max(asked, 1.0), LONGEST_WAIT)
    spread = random.uniform(1.0 - _WAIT_JITTER, 1.0 + _WAIT_JITTER)
    return min(_FIRST_WAIT * _WAIT_FACTOR ** (tried - 1) * spread, LONGEST_WAIT)


class PinnedTransport(httpx.AsyncBaseTransport):
    """Resolves the host of each request once, and connects to what was judged.

    The name stays in the Host header and in TLS, where the certificate must be of it.  Nothing is
    kept between requests: no connection, which two names of one address would share, no cookie and
    no proxy, which would resolve the name again.
    """

    def __init__(self, *, allow_private: bool, resolve: Resolve | None = None) -> None:
        self._allow_private = allow_private
        self._resolve = resolve
        self._transport = httpx.AsyncHTTPTransport(
            verify=httpx.create_ssl_context(),
            limits=httpx.Limits(max_connections=None, max_keepalive_connections=0),
        )

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        """Raises :class:`UnsafeAddressError`, :class:`socket.gaierror`, :class:`httpx.HTTPError`.

        The next address is tried where one does not answer.
        """
        target = target_of(str(request.url))
        addresses = await safe_addresses(
            target, allow_private=self._allow_private, resolve=self._resolve
        )
        *others, last = addresses[:_MOST_ADDRESSES]
        for address in others:
            try:
                return await self._ask(request, target.host, str(address))
            except (httpx.ConnectError, httpx.ConnectTimeout):
                continue
        return await self._ask(request, target.host, str(last))

    async def _ask(self, request: httpx.Request, host: str, address: str) -> httpx.Response:
        pinned = httpx.Request(
            request.method,
            request.url.copy_with(host=address),
            headers=request.headers,
            stream=request.stream,
            extensions={**request.extensions, "sni_hostname": host},
        )
        response = await self._transport.handle_async_request(pinned)
        fault = fault_of(ip_address(address), allow_private=False)
        response.extensions = {**response.extensions, MAY_BE_SHOWN: fault is None}
        return response

    async def aclose(self) -> None:
        await self._transport.aclose()
