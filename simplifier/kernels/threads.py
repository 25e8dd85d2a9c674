"""Spread a kernel over the processors.

Plain Python threads around ``nogil`` kernels instead of numba's ``prange``: the OpenMP layer dies
after a fork, the workqueue layer aborts when two threads call in, and ``parallel=True`` triples the
compile time.  The cost is about 50 microseconds a call.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from simplifier.progress import TellShare, silent


def thread_count() -> int:
    """Threads to use: ``OCCLUDER_THREADS``, else the processors that this process may use."""
    setting = os.environ.get("OCCLUDER_THREADS", "")
    if setting.isdecimal() and int(setting) > 0:
        return int(setting)
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


_GLANCE = 0.01  # seconds that the caller waits at most before it tells again


def run_chunks(
    work: Callable[[int, int], object],
    count: int,
    *,
    least: int = 1,
    chunks_per_thread: int = 4,
    tell: TellShare = silent,
) -> None:
    """Call ``work(begin, end)`` over the range 0..count in chunks, on all threads.

    ``work`` must write only to places that belong to its range: the result is then the same on any
    number of threads.  ``least`` is the smallest chunk worth a hand-over.  With ``tell`` this
    thread only watches: it tells the share of the chunks that are done every few milliseconds.

    The first exception, of ``work``, ``tell`` or an interrupt, is raised again here.  Chunks that
    have not begun are then left out, and no thread works any more.
    """
    threads = thread_count()
    chunks = min(threads * chunks_per_thread, count // max(least, 1))
    if count == 0:
        return
    if tell is silent and (threads == 1 or chunks < 2):
        work(0, count)
        return
    chunks = max(chunks, 1)
    edges = [count * i // chunks for i in range(chunks + 1)]
    pool = ThreadPoolExecutor(threads)
    try:
        jobs = [pool.submit(work, a, b) for a, b in itertools.pairwise(edges)]
        if tell is not silent:
            _watch(jobs, tell)
        for job in jobs:
            job.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _watch(jobs: Sequence[Future[object]], tell: TellShare) -> None:
    """Tell while they run, until all are done or one has failed."""
    running = set(jobs)
    while running:
        done, running = wait(running, timeout=_GLANCE, return_when=FIRST_COMPLETED)
        if any(job.exception() for job in done):
            return
        tell(1.0 - len(running) / len(jobs))
