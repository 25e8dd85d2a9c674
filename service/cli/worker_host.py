"""A worker without a server: stores, engine and signals, and when it has done its part."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import Protocol

from service.at_work import taking_jobs
from service.engines.confinement import hide_memory
from service.jobs.job import Job, JobState
from service.jobs.progress import ProgressBoard
from service.logs import log_as
from service.settings import Settings
from service.storage.database import Topic
from service.storage.opening import check_release, open_storage
from service.tracing import tracing
from simplifier.cli.plugin import print_line, print_text

_GLANCE = 0.1  # seconds between looks at what the engine does
_HOPELESS_SECONDS = 300.0
"""For which one that is to end by itself goes on where nothing works; others wait for better."""

_log = logging.getLogger(__name__)


def run_worker(settings: Settings, until_idle: float | None) -> int:
    """Do jobs until a signal says to end, or for so many seconds none was there.

    The exit status: 0, or 1 where it could not work for minutes and was to end by itself.  Raises
    :class:`~service.errors.SettingsError` where it is set up wrongly.
    """
    hide_memory()
    log_as(settings.log)
    logging.getLogger("service").setLevel(logging.INFO)
    done, board = Counter[JobState](), ProgressBoard()

    def count(job: Job) -> None:
        done[job.state] += 1

    with ending() as end, tracing(), ExitStack() as parts:
        stores = parts.enter_context(open_storage(settings, for_worker=True))
        check_release(stores.database)
        engine = parts.enter_context(taking_jobs(settings, stores, board, count))

        def hear(topic: Topic, what: str) -> None:
            if topic is not Topic.ENDED:
                engine.wake()

        parts.enter_context(stores.sharing.listening(hear, engine.wake))
        print_text(f"occluder works, {engine.workers} jobs at a time")
        problem = watch(engine, board, end, until_idle)
    if problem is not None:
        print_line(f"error: {problem}; for {_HOPELESS_SECONDS:,.0f} seconds nothing could be done")
        return 1
    print_line(_told(done))
    return 0


class Working(Protocol):
    """What does the jobs; :class:`~service.engines.engine.Engine`."""

    @property
    def idle_seconds(self) -> float | None: ...
    @property
    def problem(self) -> str | None: ...


def watch(
    engine: Working, board: ProgressBoard, end: threading.Event, until_idle: float | None
) -> str | None:
    """Wait until it is to end; what has kept it from working, if it ends for that."""
    began, hindered, told = time.monotonic(), None, False
    while not end.wait(_GLANCE):
        now, problem = time.monotonic(), engine.problem
        if not told and board.preparing is None:
            told = True
            _log.info("ready for jobs after %.1f seconds", now - began)
        if until_idle is None:
            continue
        idle = engine.idle_seconds
        if idle is not None and idle >= until_idle:
            return None
        if problem is None:
            hindered = None
        elif hindered is None:
            hindered = now
        elif now - hindered >= _HOPELESS_SECONDS:
            return problem
    return None


@contextmanager
def ending() -> Iterator[threading.Event]:
    """A block with an event that is set by the first signal to end; the second ends at once."""
    end = threading.Event()

    def handle(number: int, frame: FrameType | None) -> None:
        if end.is_set():
            # Worker processes end with this one; their leases run out, and others do their jobs.
            os._exit(128 + number)
        end.set()

    before = {one: signal.signal(one, handle) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield end
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _told(done: Counter[JobState]) -> str:
    parts = [f"{done[state]:,} {state}" for state in JobState if done[state]]
    return f"jobs that ended here: {', '.join(parts) or 'none'}"
