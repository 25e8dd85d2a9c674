"""Many assets made at a time: by processes of this machine, or by a maker that is asked."""

from __future__ import annotations

import os
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from functools import partial

from simplifier.builds.making import Job, Maker, make, make_here
from simplifier.kernels.threads import thread_count
from simplifier.processes import Outcome, Work, answer_of, run_jobs
from simplifier.progress import Cancel

_ASKED = 8  # of a service at a time, where nothing else is said
_GLANCE = 0.1  # seconds between looks at whether to stop


def made_here(
    jobs: Sequence[Job], at_once: int | None, cancel: Cancel
) -> Generator[Outcome, None, None]:
    """What comes of each, a :class:`~simplifier.builds.making.Made`, in any order.

    ``at_once``  processes; by default as many as there are processors, which they share.  Once
    ``cancel`` is set they are ended, and what they are at is lost.
    """
    processors = thread_count()
    processes = min(at_once or processors, len(jobs))
    threads = max(1, processors // processes)
    yield from run_jobs(_start, (threads,), jobs, processes, cancel)


def made_by(
    maker: Maker, jobs: Sequence[Job], at_once: int | None, cancel: Cancel
) -> Generator[Outcome, None, None]:
    """As :func:`made_here`, ``at_once`` by a maker that ends soon by itself on ``cancel``."""
    work = partial(make, maker)
    with ThreadPoolExecutor(at_once or _ASKED) as pool:
        waiting: dict[Future[Outcome], None] = {
            pool.submit(_outcome, work, place, job): None for place, job in enumerate(jobs)
        }
        try:
            while waiting and not cancel.is_set():
                for done in wait(waiting, _GLANCE, FIRST_COMPLETED).done:
                    del waiting[done]
                    yield done.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _outcome(work: Work, place: int, job: Job) -> Outcome:
    return Outcome(place, answer_of(work, job))


def _start(threads: int) -> Work:
    """What a process does with a job, on so many threads."""
    os.environ["OCCLUDER_THREADS"] = str(threads)
    return partial(make, make_here)
