"""Where webhooks may go: only out, to the public internet.

The service runs where its users often cannot reach: beside databases, dashboards and the metadata
of a cloud.  A webhook must not be their way in (server-side request forgery).  What counts is the
address that is connected to, however the URL spells it, so names are resolved here, every address
must be allowed, and the connection is made to an address that was judged
(:mod:`service.webhooks.posting`), never to the name again, whose answer may change.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address

import httpx

from service.errors import FieldError, InvalidOptionsError
from service.jobs.stores import LONGEST_URL

Address = IPv4Address | IPv6Address
Resolve = Callable[[str, int], Awaitable[list[Address]]]
"""The addresses of a host name and a port.  Raises :class:`socket.gaierror`."""

_log = logging.getLogger("service.webhooks")

_RESOLVE_SECONDS = 2.0  # that a submission waits for a name; it is judged again when it is used

# The special-purpose registries of IANA.  A table, since what `ipaddress` calls global has changed
# between releases of Python.
_PRIVATE_V4 = tuple(
    IPv4Network(one)
    for one in ("10.0.0.0/8", "100.64.0.0/10", "127.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16")
)
_SPECIAL_V4 = tuple(
    IPv4Network(one)
    for one in (
        "0.0.0.0/8", "169.254.0.0/16", "192.0.0.0/24", "192.0.2.0/24", "192.88.99.0/24",
        "198.18.0.0/15", "198.51.100.0/24", "203.0.113.0/24", "224.0.0.0/4", "240.0.0.0/4",
    )
)  # fmt: skip
_GLOBAL_V6 = IPv6Network("2000::/3")
_PRIVATE_V6 = (IPv6Network("::1/128"), IPv6Network("fc00::/7"))
_SPECIAL_V6 = tuple(
    IPv6Network(one) for one in ("2001::/23", "2001:db8::/32", "2002::/16", "3fff::/20")
)
_NAT64 = IPv6Network("64:ff9b::/96")

_METADATA = frozenset(
    ip_address(one) for one in ("100.100.100.200", "168.63.129.16", "fd00:ec2::254", "fd20:ce::254")
)
"""Of clouds that keep them at addresses which look like others; the rest are link-local."""


class UnsafeAddressError(Exception):
    """No webhook may go there: why, and what to do.  Sentences without a full stop."""

    def __init__(self, detail: str, remedy: str) -> None:
        self.detail, self.remedy = detail, remedy
        super().__init__(f"{detail}; {remedy}")


@dataclass(frozen=True)
class Target:
    """The place that a URL leads to by its spelling; ``host`` in ASCII, for the resolver."""

    url: httpx.URL
    host: str
    port: int


async def check_webhook(url: str, *, allow_private: bool, resolve: Resolve | None = None) -> None:
    """Refuse a webhook as it is submitted.

    Raises :class:`~service.errors.InvalidOptionsError`, of the field ``webhook``.  A name that
    cannot be resolved just now passes: it is judged whenever it is used.
    """
    try:
        target = target_of(url)
        async with asyncio.timeout(_RESOLVE_SECONDS):
            await safe_addresses(target, allow_private=allow_private, resolve=resolve)
    except UnsafeAddressError as error:
        raise InvalidOptionsError([FieldError("webhook", error.detail, error.remedy)]) from None
    except TimeoutError:
        pass
    except socket.gaierror as error:
        if error.errno != socket.EAI_AGAIN:
            unsafe = _unsafe(target.host)
            raise InvalidOptionsError(
                [FieldError("webhook", unsafe.detail, unsafe.remedy)]
            ) from None


def target_of(text: str) -> Target:
    """Raises :class:`UnsafeAddressError` for a URL that no webhook can have, whoever asks."""
    try:
        url = httpx.URL(text)
        host, port = url.raw_host.decode("ascii"), url.port
    except (httpx.InvalidURL, ValueError) as error:
        raise UnsafeAddressError(
            f"it is not a URL ({error})", "give an http or https URL"
        ) from None
    if url.scheme not in ("http", "https") or not host:
        raise UnsafeAddressError("it is not an http URL with a host", "give an http or https URL")
    if url.userinfo:
        raise UnsafeAddressError(
            "it holds a user or a password", "leave it out; webhooks are signed in their place"
        )
    if len(text) > LONGEST_URL:
        raise UnsafeAddressError("it is too long", f"give at most {LONGEST_URL} characters")
    if port is None:
        port = 443 if url.scheme == "https" else 80
    if not 1 <= port <= 65535:
        raise UnsafeAddressError(f"{port} is no port", "choose 1 to 65535")
    return Target(url, host, port)


async def safe_addresses(
    target: Target, *, allow_private: bool, resolve: Resolve | None = None
) -> list[Address]:
    """The addresses of a target's host, of which each may be connected to.

    Raises :class:`UnsafeAddressError` when one may not, and :class:`socket.gaierror`.
    """
    if not allow_private and _is_local_name(target.host):
        raise _unsafe(target.host)
    for address in (found := await (resolve or addresses_of)(target.host, target.port)):
        fault = fault_of(address, allow_private=allow_private)
        if fault is not None:
            _log.info("no webhook may go to %s, %s", address, fault)
            raise _unsafe(target.host)
    return found


def _is_local_name(host: str) -> bool:
    """Names that no resolver is asked for."""
    return f".{host.removesuffix('.').lower()}".endswith(".localhost")


def _unsafe(host: str) -> UnsafeAddressError:
    """The same for a name of the network inside and for none: nobody learns which there are."""
    return UnsafeAddressError(
        f"{host!r} has no public address",
        "check the host's name; OCCLUDER_WEBHOOK_PRIVATE allows private addresses, if the "
        "service's owner wants that",
    )


def fault_of(address: Address, *, allow_private: bool) -> str | None:
    """Why no webhook may go to an address; None where one may.

    ``allow_private`` lets loopback and private networks pass, and nothing else: link-local
    addresses and what else serves the secrets of a cloud stay out.
    """
    if isinstance(address, IPv6Address):
        inner = _inner_address(address)
        if inner is not None:
            return fault_of(inner, allow_private=allow_private)
    if address in _METADATA:
        return "where a cloud keeps secrets"
    if isinstance(address, IPv4Address):
        private = any(address in network for network in _PRIVATE_V4)
        special = any(address in network for network in _SPECIAL_V4)
    else:
        private = any(address in network for network in _PRIVATE_V6)
        special = address not in _GLOBAL_V6 or any(address in one for one in _SPECIAL_V6)
    if private:
        return None if allow_private else "which is private"
    return "which is not public" if special else None


def _inner_address(address: IPv6Address) -> IPv4Address | None:
    """The IPv4 address that an IPv6 one stands for: mapped, 6to4 or NAT64."""
    if address in _NAT64:
        return IPv4Address(int(address) & 0xFFFFFFFF)
    return address.ipv4_mapped or address.sixtofour


async def addresses_of(host: str, port: int) -> list[Address]:
    """Ask the system's resolver.  Raises :class:`socket.gaierror`.

    In a thread of its own: the resolver cannot be interrupted, and nothing waits for a daemon.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[list[Address]] = loop.create_future()

    def settle(found: list[Address] | OSError) -> None:
        if answer.done():  # the caller is gone
            return
        if isinstance(found, OSError):
            answer.set_exception(found)
        else:
            answer.set_result(found)

    def ask() -> None:
        found = _ask_resolver(host, port)
        try:
            loop.call_soon_threadsafe(settle, found)
        except RuntimeError:  # the loop has closed meanwhile
            return

    threading.Thread(target=ask, name="resolver", daemon=True).start()
    return await answer


def _ask_resolver(host: str, port: int) -> list[Address] | OSError:
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except OSError as error:
        return error
    except UnicodeError:  # a label that is empty or too long
        return socket.gaierror(socket.EAI_NONAME, "not a host's name")
    return [ip_address(str(one[4][0])) for one in found]
