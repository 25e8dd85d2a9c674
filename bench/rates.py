"""What this machine can do at best, on one core: the rates that floors are computed from."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simplifier.kernels.compiled.kernel import inner_kernel

_LEAST = 0.02  # seconds a timing should last, so that the clock and the call do not count
_TIMINGS = 7


def seconds(work: Callable[[], object], prepare: Callable[[], object] | None = None) -> float:
    """Median time of one call after a warm one; ``prepare`` runs before each and is not timed.

    Short work without preparation is called many times between two looks at the clock.
    """
    calls = 1
    once = _clocked(work, prepare, 1)
    once = _clocked(work, prepare, 1)
    if prepare is None:
        calls = max(1, round(_LEAST / max(once, 1e-7)))
    return statistics.median(_clocked(work, prepare, calls) for _ in range(_TIMINGS)) / calls


def _clocked(work: Callable[[], object], prepare: Callable[[], object] | None, calls: int) -> float:
    if prepare is not None:
        prepare()
    begin = time.perf_counter()
    for _ in range(calls):
        work()
    return time.perf_counter() - begin


def bytes_a_second(size: int) -> float:
    """Bytes read plus bytes written a second by a copy whose two arrays hold ``size`` bytes."""
    source, target = np.ones(max(size // 16, 64)), np.zeros(max(size // 16, 64))
    return 2.0 * source.nbytes / seconds(lambda: np.copyto(target, source))


def lookups_a_second(table: NDArray[np.uint8], places: NDArray[np.int64]) -> float:
    """Sums of ``table[place]`` a second, each place read from an array that fits a cache."""
    return len(places) / seconds(lambda: _sum_at(table, places))


def word_operations_a_second() -> float:
    """Shifts and ANDs of 64-bit words a second, 64 words in the first-level cache."""
    words, rounds = np.full(64, ~np.uint64(0)), 4096
    return 2.0 * words.size * rounds / seconds(lambda: _shift_and(words, rounds))


@inner_kernel
def _sum_at(table: NDArray[np.uint8], places: NDArray[np.int64]) -> int:
    total = 0
    for place in places:
        total += table[np.uint64(place)]
    return total


@inner_kernel
def _shift_and(words: NDArray[np.uint64], rounds: int) -> None:
    one = np.uint64(1)
    for _ in range(rounds):
        for i in range(64):
            words[i] &= words[i] >> one
