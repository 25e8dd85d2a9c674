"""Keeps other web sites from reaching the service through a browser that can reach it.

A site may let its name point to this machine (DNS rebinding) and then read what the service says,
as one origin with it: so requests have to come to a name of ours.  And it may send requests without
reading the answers (cross-site request forgery): so whatever changes something must not come from
another origin.  Both matter where no key is needed, which a site could not know.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.answers.problems import ProblemResponse
from service.errors import ForbiddenError, MisdirectedError, ServiceError
from service.settings import Settings

_AUTHORITY = re.compile(r"(?:\[(?P<v6>[0-9A-Fa-f:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(?::\d{1,5})?")
_READING = frozenset({"GET", "HEAD", "OPTIONS"})


class HostGuard:
    """Refuses requests to hosts that this is not, and changes that other sites ask for."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app = app
        self._hosts = _OwnHosts.of(settings)
        self._public = urlsplit(settings.public_url).netloc.lower()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        try:
            self._check(scope)
        except ServiceError as refusal:
            await _refuse(refusal, scope, receive, send)
            return
        await self._app(scope, receive, send)

    def _check(self, scope: Scope) -> None:
        headers = Headers(scope=scope)
        told = headers.getlist("host")
        authority = told[0].lower() if len(told) == 1 else ""
        match = _AUTHORITY.fullmatch(authority)
        if match is None or not self._hosts.has(match["v6"] or match["name"]):
            raise MisdirectedError(
                f"{authority or 'a request without one host'!r} is no name of this service",
                remedy="ask by its address, or add the name to OCCLUDER_ALLOWED_HOSTS",
            )
        if scope["type"] == "websocket" or scope["method"] not in _READING:
            self._check_origin(headers, authority)

    def _check_origin(self, headers: Headers, authority: str) -> None:
        """Programs send neither header; browsers cannot be made to leave them out."""
        origin = headers.get("origin")
        other = origin is not None and origin.partition("://")[2].lower() not in (
            authority,
            self._public or authority,
        )
        if other or headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
            raise ForbiddenError(
                f"a page of {origin or 'another site'} may change nothing here",
                remedy="send the request from a program, or from a page of this service",
            )


@dataclass(frozen=True)
class _OwnHosts:
    """The names and addresses that requests may come to.

    ``addresses``  whether any address will do: one cannot be made to point elsewhere.
    """

    names: frozenset[str]
    addresses: bool
    anything: bool

    @classmethod
    def of(cls, settings: Settings) -> _OwnHosts:
        allowed = {name.lower() for name in settings.allowed_hosts}
        public = urlsplit(settings.public_url).hostname
        return cls(
            names=frozenset(
                {"localhost", settings.host.lower(), *allowed, *filter(None, [public])}
            ),
            addresses=not settings.on_loopback,
            # A site that comes by another name has no key to come with.
            anything="*" in allowed or (settings.keys_needed and not allowed),
        )

    def has(self, host: str) -> bool:
        if self.anything or host.removesuffix(".") in self.names or self._has_pattern(host):
            return True
        address = _address(host)
        return address is not None and (self.addresses or address.is_loopback)

    def _has_pattern(self, host: str) -> bool:
        """``*.example.org`` stands for every name below it."""
        return any(name.startswith("*.") and host.endswith(name[1:]) for name in self.names)


def _address(host: str) -> IPv4Address | IPv6Address | None:
    try:
        return ip_address(host)
    except ValueError:
        return None


async def _refuse(refusal: ServiceError, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    answer = ProblemResponse(refusal, scope["path"])
    answer.headers["Connection"] = "close"
    await answer(scope, receive, send)
