"""What does the jobs, on the stores of a server or of a worker alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
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
    """What the settings say, while the block lasts."""
    sharing = stores.sharing
    reclaimer = Reclaimer(stores.jobs, board, settings.lease_seconds, sharing.leads, on_end)
    with ExitStack() as parts:
        if stores.progress is not None:
            parts.enter_context(SharedProgress(board, stores.progress).running())
        parts.enter_context(reclaimer.running())
        if settings.engine is EngineChoice.NONE:
            yield Others()
            return
        engine = Engine(
            stores.jobs, stores.blobs, board, settings, stores.scratch, on_end,
            shared=sharing.shared,
        )  # fmt: skip
        # Of a database that others share, only the leases that have run out are taken back.
        if sharing.shared:
            engine.start()
        else:
            engine.start(partial(reclaimer.reclaim, all_leases=True))
        parts.callback(engine.stop)
        yield engine
