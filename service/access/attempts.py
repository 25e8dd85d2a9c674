"""How often an address, or a beginning of keys from there, may be wrong."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import IPv6Address, IPv6Network, ip_address
from typing import Protocol

LIMIT, SECONDS = 20, 60.0
"""Failures in a row that are free, and the time in which as many are from then on."""

_MOST_ADDRESSES = 10_000


class Attempts(Protocol):
    """A bucket an address, and one for each ``hint`` there, which leak.  Safe from any thread."""

    def count(self, address: str, hint: str = "") -> None:
        """Note one more failure."""

    def seconds_to_wait(self, address: str, hint: str = "") -> int:
        """How long to wait before the next failure; 0 where it may be at once."""


def bucket_of(address: str, hint: str) -> str:
    """IPv6 addresses count by their /64 network, of which one host may have every address."""
    return f"{_network(address)} {hint}"


def level_at(level: float, passed: float, limit: int = LIMIT, seconds: float = SECONDS) -> float:
    """What is left of failures that weighed so much some time ago; they fade evenly."""
    return max(0.0, level - max(0.0, passed) * limit / seconds)


def wait_at(level: float, limit: int = LIMIT, seconds: float = SECONDS) -> int:
    """Seconds until one more failure is within the limit."""
    return max(0, math.ceil((level - limit + 1.0) * seconds / limit))


@dataclass(frozen=True)
class _Bucket:
    """Failures that weigh so much at a time of the clock."""

    level: float
    at: float


class FailedAttempts:
    """The :class:`Attempts` of one process; ``clock`` in seconds.

    ``limit`` failures in a row are free, and ``limit`` a ``seconds`` from then on.
    """

    def __init__(
        self, clock: Callable[[], float], limit: int = LIMIT, seconds: float = SECONDS
    ) -> None:
        self._clock = clock
        self._limit = limit
        self._seconds = seconds
        self._lock = threading.Lock()
        self._buckets: dict[str, _Bucket] = {}  # by the time of the last failure

    def count(self, address: str, hint: str = "") -> None:
        """Note one more failure."""
        network = bucket_of(address, hint)
        with self._lock:
            now = self._clock()
            level = self._level(network, now) + 1.0
            self._buckets.pop(network, None)
            self._buckets[network] = _Bucket(level, now)
            if len(self._buckets) > _MOST_ADDRESSES:
                del self._buckets[next(iter(self._buckets))]

    def seconds_to_wait(self, address: str, hint: str = "") -> int:
        """How long to wait before the next failure; 0 where it may be at once."""
        with self._lock:
            level = self._level(bucket_of(address, hint), self._clock())
        return wait_at(level, self._limit, self._seconds)

    def _level(self, network: str, now: float) -> float:
        bucket = self._buckets.get(network)
        if bucket is None:
            return 0.0
        return level_at(bucket.level, now - bucket.at, self._limit, self._seconds)


def _network(address: str) -> str:
    try:
        parsed = ip_address(address)
    except ValueError:  # a socket without an address
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return str(IPv6Network((int(parsed), 64), strict=False))
    return address
