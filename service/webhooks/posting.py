"""One try to tell one receiver."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import httpx

from service.headers.retry_after import retry_after
from service.webhooks.address_guard import UnsafeAddressError

_READ_BYTES = 4096
_READ_SECONDS = 1.0
_CONNECT_SHARE = 0.25  # of the time, so that another address gets its turn


@dataclass(frozen=True)
class Outcome:
    """What came of a try.

    ``reason``  why it was not heard; empty when it was.
    ``gone``    the receiver wants no more of it.
    ``wait``    seconds that the receiver asks for before the next try.
    """

    reason: str = ""
    gone: bool = False
    wait: float | None = None

    @property
    def heard(self) -> bool:
        return not self.reason


async def attempt(
    transport: httpx.AsyncBaseTransport,
    url: str,
    headers: Mapping[str, str],
    body: bytes,
    seconds: float,
) -> Outcome:
    """POST a body; any status of 200 to 299 is a yes.  Redirects are not followed."""
    try:
        async with asyncio.timeout(seconds):
            response = await _post(transport, url, headers, body, seconds)
    except (TimeoutError, httpx.TimeoutException):
        return Outcome(f"no answer within {seconds:g} seconds")
    except socket.gaierror:
        return Outcome("the host has no address")
    except (UnsafeAddressError, httpx.HTTPError, httpx.InvalidURL, OSError) as error:
        return Outcome(str(error) or type(error).__name__)
    try:
        await _read_a_little(response)
    finally:
        await response.aclose()
    return _outcome_of(response)


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


async def _read_a_little(response: httpx.Response) -> None:
    """So that a receiver that is still writing a short answer meets no closed connection.

    The status has said all that counts, so it does not matter how this ends.
    """
    size = 0
    with suppress(TimeoutError, httpx.HTTPError):
        async with asyncio.timeout(_READ_SECONDS):
            async for piece in response.aiter_raw():
                size += len(piece)
                if size > _READ_BYTES:
                    return


def _outcome_of(response: httpx.Response) -> Outcome:
    if response.is_success:
        return Outcome()
    return Outcome(
        f"the receiver answered {response.status_code}",
        gone=response.status_code == httpx.codes.GONE,
        wait=retry_after(response.headers.get("retry-after"), time.time()),
    )
