"""Whom a request comes from, where a proxy of ours stands in between.

A proxy adds the address that it was asked from to the end of ``X-Forwarded-For`` or ``Forwarded``
(RFC 7239); what stands before that came from whoever asked, and may be made up.  So both are read
from the end: the first address that is none of our proxies' is the one that a proxy of ours saw.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

Network = IPv4Network | IPv6Network
Address = IPv4Address | IPv6Address

_FOR = re.compile(r'(?:^|;)\s*for\s*=\s*("?)([^";]*)\1\s*(?:;|$)', re.IGNORECASE)
_WITH_PORT = re.compile(r"\[([0-9A-Fa-f:.]+)\](?::\d+)?|(\d+\.\d+\.\d+\.\d+):\d+")


class ForwardedAddress:
    """Puts the address that trusted proxies tell in place of theirs; that of others is their own.

    Where both headers are there and say different things, one of them is not our proxy's, and
    which cannot be told: then neither counts.
    """

    def __init__(self, app: ASGIApp, trusted: Sequence[Network]) -> None:
        self._app, self._trusted = app, trusted

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if self._trusted and scope["type"] in ("http", "websocket") and scope.get("client"):
            address = scope["client"][0]
            told = self._told(address, Headers(scope=scope))
            if told != address:
                scope = {**scope, "client": (told, 0)}
        await self._app(scope, receive, send)

    def _told(self, peer: str, headers: Headers) -> str:
        if not self._is_trusted(_address(peer)):
            return peer
        ways = [_by_list(headers), _by_pairs(headers)]
        found = {self._right_most(peer, steps) for steps in ways if steps}
        return found.pop() if len(found) == 1 else peer

    def _right_most(self, peer: str, steps: Sequence[str]) -> str:
        """The last step that is none of our proxies; what is no address ends the search."""
        found = peer
        for step in reversed(steps):
            address = _address(step)
            if address is None:
                return found
            found = str(address)
            if not self._is_trusted(address):
                return found
        return found

    def _is_trusted(self, address: Address | None) -> bool:
        return address is not None and any(address in network for network in self._trusted)


def _by_list(headers: Headers) -> list[str]:
    return [one for line in headers.getlist("x-forwarded-for") for one in line.split(",")]


def _by_pairs(headers: Headers) -> list[str]:
    """What follows each ``for=``; empty for a step that hides it."""
    steps = [one for line in headers.getlist("forwarded") for one in line.split(",")]
    matches = [_FOR.search(step) for step in steps]
    return [match[2] if match else "" for match in matches]


def _address(text: str) -> Address | None:
    """An address, with or without a port; one that IPv6 maps is the IPv4 address itself."""
    text = text.strip()
    match = _WITH_PORT.fullmatch(text)
    with suppress(ValueError):
        found = ip_address((match[1] or match[2]) if match else text)
        mapped = found.ipv4_mapped if isinstance(found, IPv6Address) else None
        return mapped or found
    return None
