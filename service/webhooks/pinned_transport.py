"""HTTP to addresses that were judged."""

from __future__ import annotations

import httpx

from service.webhooks.address_guard import Resolve, safe_addresses, target_of

_MOST_ADDRESSES = 4


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
        return await self._transport.handle_async_request(pinned)

    async def aclose(self) -> None:
        await self._transport.aclose()
