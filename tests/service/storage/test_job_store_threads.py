"""Many threads at once, as the server and its engines call."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from service.jobs.job import JobState
from service.jobs.stores import JobFilter
from service.storage.job_store import SqlJobStore
from tests.service.storage.samples import results, submission, summary

THREADS = 16


def in_threads(work: Callable[[int], list[str]]) -> list[str]:
    """What all threads gave; all begin at the same moment."""
    ready = threading.Barrier(THREADS)

    def begin(number: int) -> list[str]:
        ready.wait(timeout=30.0)
        return work(number)

    with ThreadPoolExecutor(THREADS) as pool:
        return [one for found in pool.map(begin, range(THREADS)) for one in found]


def test_each_job_is_claimed_once(jobs: SqlJobStore) -> None:
    ids = [jobs.submit(submission(str(number)), 1000)[0].id for number in range(40)]

    def claim_all(thread: int) -> list[str]:
        claimed = []
        while claim := jobs.claim(f"owner {thread}", 30.0):
            claimed.append(claim.job.id)
            jobs.renew([claim], 30.0)
        return claimed

    assert sorted(in_threads(claim_all)) == sorted(ids)


def test_submitting_working_and_reading_at_once_loses_nothing(jobs: SqlJobStore) -> None:
    def live(thread: int) -> list[str]:
        for number in range(3):
            jobs.submit(submission(f"{thread} {number}", asset=f"asset {number}"), 1000)
            jobs.jobs("studio", JobFilter(), before=None, limit=5)
            claim = jobs.claim(f"owner {thread}", 30.0)
            assert claim is not None
            assert jobs.succeed(claim, results(), summary())
        return []

    in_threads(live)
    assert jobs.counts()[JobState.SUCCEEDED] == THREADS * 3


def test_the_queue_never_grows_beyond_its_limit(jobs: SqlJobStore) -> None:
    def submit(thread: int) -> list[str]:
        try:
            return [jobs.submit(submission(str(thread)), queue_limit=10)[0].id]
        except Exception as refusal:
            return [type(refusal).__name__]

    outcomes = in_threads(submit)
    assert outcomes.count("QueueFullError") == THREADS - 10
    assert jobs.counts()[JobState.QUEUED] == 10
