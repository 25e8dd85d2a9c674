"""How often addresses have tried keys that nobody has."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import IPv6Address, IPv6Network, ip_address

_MOST_ADDRESSES = 10_000


@dataclass(frozen=True)
class _Bucket:
    """Failures that weigh at a time of the clock; they fade evenly."""

    level: float
    at: float


class FailedAttempts:
    """A bucket an address, which leaks.  Safe from any thread; ``clock`` in seconds.

    ``limit`` failures in a row are free, and ``limit`` a ``seconds`` from then on.  IPv6 addresses
    count by their /64 network, of which one host may have every address.
    """

    def __init__(self, clock: Callable[[], float], limit: int = 20, seconds: float = 60.0) -> None:
        self._clock = clock
        self._limit = limit
        self._seconds = seconds
        self._lock = threading.Lock()
        self._buckets: dict[str, _Bucket] = {}  # by the time of the last failure

    def count(self, address: str) -> None:
        """One more failure."""
        network = _network(address)
        with self._lock:
            now = self._clock()
            level = self._level(network, now) + 1.0
            self._buckets.pop(network, None)
            self._buckets[network] = _Bucket(level, now)
            if len(self._buckets) > _MOST_ADDRESSES:
                del self._buckets[next(iter(self._buckets))]

    def seconds_to_wait(self, address: str) -> int:
        """Until it may fail again; 0 where it may at once."""
        with self._lock:
            level = self._level(_network(address), self._clock())
        excess = level - self._limit + 1.0
        return max(0, math.ceil(excess * self._seconds / self._limit))

    def _level(self, network: str, now: float) -> float:
        bucket = self._buckets.get(network)
        if bucket is None:
            return 0.0
        return max(0.0, bucket.level - (now - bucket.at) * self._limit / self._seconds)


def _network(address: str) -> str:
    try:
        parsed = ip_address(address)
    except ValueError:  # a socket without an address
        return address
    if isinstance(parsed, IPv6Address) and parsed.ipv4_mapped is None:
        return str(IPv6Network((int(parsed), 64), strict=False))
    return address
