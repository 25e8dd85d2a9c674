"""What does the jobs, on the stores of a server or of a worker alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from typing import Protocol

from service.engines.engine import Engine
from service.engines.reclaiming import Reclaimer
from service.engines.shared_progress import SharedProgress
from service.jobs.job import Job
from service.jobs.progress import ProgressBoard
from service.settings import EngineChoice, Settings
from service.storage.opening import Storage


class Runner(Protocol):
    """Does the jobs of a server, or leaves them to others."""

    @property
    def workers(self) -> int:
        """Processes that there are to be; ``live`` those that can do a job or do one."""

    @property
    def live(self) -> int: ...

    @property
    def busy(self) -> int:
        """Jobs that are done just now."""

    @property
    def problem(self) -> str | None:
        """What keeps it from working, in words; None while it works."""

    def wake(self) -> None:
        """A job waits, or is to end: look now rather than later.  From any thread."""


class Others:
    """Leaves the jobs to others that share the database, who hear of them from it."""

    workers = live = busy = 0
    problem = None

    def wake(self) -> None:
        """They are awake."""


@contextmanager
def running_engine(
    settings: Settings, stores: Storage, board: ProgressBoard, on_end: Callable[[Job], None]
) -> Iterator[Runner]:
    """What the settings of a server say, while the block lasts."""
    sharing = stores.sharing
    reclaimer = Reclaimer(stores.jobs, board, settings.lease_seconds, sharing.leads, on_end)
    with reclaimer.running():
        if settings.engine is not EngineChoice.LOCAL:
            with sharing_progress(stores, board):
                yield Others()
            return
        # Of a database that others share, only the leases that have run out are taken back.
        before = None if sharing.shared else partial(reclaimer.reclaim, all_leases=True)
        with taking_jobs(settings, stores, board, on_end, before) as engine:
            yield engine


@contextmanager
def taking_jobs(
    settings: Settings,
    stores: Storage,
    board: ProgressBoard,
    on_end: Callable[[Job], None],
    before: Callable[[], None] | None = None,
) -> Iterator[Engine]:
    """Worker processes of this one, which tell others how far they are, while the block lasts.

    ``before``  done before the first job is taken.
    """
    engine = Engine(
        stores.jobs, stores.blobs, board, settings, stores.scratch, on_end,
        shared=stores.sharing.shared,
    )  # fmt: skip
    with sharing_progress(stores, board):
        engine.start(before or (lambda: None))
        try:
            yield engine
        finally:
            engine.stop()


def sharing_progress(stores: Storage, board: ProgressBoard) -> AbstractContextManager[None]:
    """Tell others how far jobs are, and hear it of them, while the block lasts."""
    if stores.progress is None:
        return nullcontext()
    return SharedProgress(board, stores.progress).running()
