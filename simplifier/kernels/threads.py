"""Spread a kernel over the processors.

Plain Python threads around ``nogil`` kernels instead of numba's ``prange``: the OpenMP layer dies
after a fork, the workqueue layer aborts when two threads call in, and ``parallel=True`` triples the
compile time.  The cost is about 50 microseconds a call.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def thread_count() -> int:
    """Threads to use: ``OCCLUDER_THREADS``, else the processors that this process may use."""
    setting = os.environ.get("OCCLUDER_THREADS", "")
    if setting.isdecimal() and int(setting) > 0:
        return int(setting)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_chunks(
    work: Callable[[int, int], object], count: int, *, least: int = 1, chunks_per_thread: int = 4
) -> None:
    """Call ``work(begin, end)`` over the range 0..count in chunks, on all threads.

    ``work`` must write only to places that belong to its range: the result is then the same on any
    number of threads.  ``least`` is the smallest chunk worth a hand-over.  The first exception is
    raised again here.
    """
    threads = thread_count()
    chunks = min(threads * chunks_per_thread, count // max(least, 1))
    if threads == 1 or chunks < 2:
        if count > 0:
            work(0, count)
        return
    edges = [count * i // chunks for i in range(chunks + 1)]
    with ThreadPoolExecutor(threads) as pool:
        for job in [pool.submit(work, a, b) for a, b in itertools.pairwise(edges)]:
            job.result()
