"""Makes files of jobs when somebody asks for them, by one process of their own.

The process is started when it is first needed and ended when nobody has asked for a while.  What it
is asked for waits in a line of bounded length, of each tenant and of all.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from service.engines.attempt import GivenUp, Hindered, NotDone, Succeeded, attempt
from service.engines.life import LifeWatch
from service.engines.messages import Task
from service.engines.process import ProcessDiedError, WorkerProcess
from service.engines.recording import Recorder
from service.engines.signals import Orders
from service.engines.slot import laid_out, removing
from service.engines.trouble import StoppedError, Trouble
from service.errors import (
    DiskFullError,
    JobFailedError,
    NotFoundError,
    NotReadyError,
    ServiceError,
)
from service.jobs.job import Job, JobFile
from service.jobs.on_demand import PAGES, can_be_made, is_page, made_of, needs_uploads
from service.jobs.stores import BlobStore, JobStore
from service.settings import Settings

logger = logging.getLogger(__name__)

ON_DEMAND_WORK = "service.engines.work.on_demand:start"
"""What the process runs: the library's part is imported there and nowhere else."""

_MOST, _MOST_OF_TENANT = 64, 8
"""Files that wait to be made; the pages of a job count as one."""

_SECONDS = 300.0  # that a file may take, and that its process may take to start
_IDLE = 60.0  # seconds after which a process that nobody needs is ended
_GLANCE = 0.05  # seconds between looks at a process that starts


@dataclass
class _Asked:
    """A file of a job that is wanted, by one or more."""

    job: Job
    name: str
    done: Future[None] = field(default_factory=Future)

    @property
    def key(self) -> tuple[str, str]:
        """The same for what is made together."""
        return self.job.id, PAGES["report"] if is_page(self.name) else self.name


class OnDemand:
    """A :class:`~service.jobs.on_demand.FileMaker`.  Safe from any thread."""

    def __init__(
        self,
        jobs: JobStore,
        blobs: BlobStore,
        settings: Settings,
        scratch: Path,
        work: str = ON_DEMAND_WORK,
    ) -> None:
        """``scratch`` is on the disk of the blobs."""
        self._jobs, self._blobs, self._settings, self._scratch = jobs, blobs, settings, scratch
        self._work = work
        self._lock = threading.Lock()
        self._asked: dict[tuple[str, str], _Asked] = {}
        self._line: queue.SimpleQueue[_Asked | None] = queue.SimpleQueue()
        self._trouble, self._orders = Trouble(), Orders()
        self._process: WorkerProcess | None = None
        # It starts the process, which dies with it.
        self._thread = threading.Thread(target=self._run, name="occluder on demand", daemon=True)

    def start(self) -> None:
        """Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """End the process; who waits for files is told to come again."""
        self._trouble.stop()
        self._orders.stop()
        self._line.put(None)
        self._thread.join()
        with self._lock:
            left = list(self._asked.values())
            self._asked.clear()
        for asked in left:
            asked.done.set_exception(NotReadyError("the service ends", remedy="try again later"))

    def make(self, job: Job, name: str) -> Future[None]:
        asked = _Asked(job, name)
        with self._lock:
            if self._trouble.stopped:
                raise NotReadyError("the service ends", remedy="try again later")
            if asked.key in self._asked:
                return self._asked[asked.key].done
            of_tenant = sum(one.job.tenant == job.tenant for one in self._asked.values())
            if len(self._asked) >= _MOST or of_tenant >= _MOST_OF_TENANT:
                raise NotReadyError(
                    "files of many jobs are being made",
                    remedy="try again in a few seconds",
                    headers={"Retry-After": "5"},
                )
            self._asked[asked.key] = asked
        self._line.put(asked)
        return asked.done

    def _run(self) -> None:
        try:
            while not self._trouble.stopped:
                asked = self._next()
                if asked is not None:
                    self._settle(asked)
        except StoppedError:
            return
        finally:
            self._discard()

    def _next(self) -> _Asked | None:
        """Who is next; the process is ended where nobody comes for long."""
        try:
            return self._line.get(timeout=_IDLE)
        except queue.Empty:
            self._discard()
            return self._line.get()

    def _settle(self, asked: _Asked) -> None:
        """Make it, and tell all who wait; only the engine's stop is raised."""
        fault: ServiceError | None = None
        try:
            self._make(asked.job, asked.name)
        except ServiceError as error:
            fault = error
        except StoppedError:
            raise
        except Exception:
            logger.exception(
                "'%s' of job %s failed by a fault of the program", asked.name, asked.job.id
            )
            self._discard()
            fault = ServiceError(f"'{asked.name}' could not be made", remedy="try again")
        with self._lock:
            self._asked.pop(asked.key, None)
        if fault is None:
            asked.done.set_result(None)
        else:
            asked.done.set_exception(fault)

    def _make(self, job: Job, name: str) -> None:
        files = self._jobs.files(job.id)
        if not files:
            raise _gone(name)
        if not can_be_made(job, {file.name for file in files}, name):
            return  # somebody had it made since
        folder = self._scratch / f"demand-{job.id}"
        with removing(folder):
            task = self._task(job, name, files, folder)
            self._do(task)
            with self._blobs.keeping() as keeping:
                recorder = Recorder(self._jobs, self._blobs, self._trouble)
                made = recorder.store_files(keeping, folder / "results")
                if not self._jobs.add_files(job.id, made):
                    raise _gone(name)

    def _task(self, job: Job, name: str, files: Sequence[JobFile], folder: Path) -> Task:
        uploads, results = needs_uploads(job, name), made_of(name)
        needed = [file for file in files if (uploads if file.is_input else file.name in results)]
        try:
            inputs = laid_out(folder, needed, self._blobs)
        except KeyError:
            raise _gone(name) from None
        labels = {PurePosixPath(one.name).stem: one.label for one in needed if one.label}
        return Task(
            job.kind, job.name, job.options, inputs, str(folder / "results"),
            str(folder / "scratch"), 1, self._settings.job_memory, self._settings.max_unpacked,
            labels, wanted=name,
        )  # fmt: skip

    def _do(self, task: Task) -> None:
        what = f"'{task.wanted}'"
        try:
            process = self._ready_process()
            silence = self._settings.lease_seconds
            outcome = attempt(process, task, _SECONDS, silence, self._orders, lambda progress: None)
        except (ProcessDiedError, OSError) as error:
            self._discard()
            raise NotReadyError(
                f"{what} cannot be made now ({error})", remedy="try again"
            ) from error
        match outcome:
            case Succeeded():
                return
            case GivenUp():
                raise StoppedError
            case Hindered():
                raise DiskFullError(f"there is no room for {what}", remedy=outcome.failure.remedy)
            case NotDone() if outcome.final:
                failure = outcome.failure
                raise JobFailedError(
                    f"{what} could not be made: {failure.detail}", remedy=failure.remedy
                )
            case NotDone():
                raise NotReadyError(
                    f"{what} could not be made: {outcome.failure.detail}", remedy="try again"
                )

    def _ready_process(self) -> WorkerProcess:
        """Raises :class:`ProcessDiedError` and OSError."""
        if self._process is not None and (
            not self._process.alive or self._process.tasks >= self._settings.jobs_per_process
        ):
            self._discard()
        if self._process is None:
            self._process = WorkerProcess(self._work)
        process, life, until = self._process, LifeWatch(self._process), time.monotonic() + _SECONDS
        while not process.ready:
            process.receive(_GLANCE)
            self._trouble.pause(0.0)
            if time.monotonic() >= until or life.silence() >= self._settings.lease_seconds:
                raise ProcessDiedError("did not get ready")
        return process

    def _discard(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process = None


def _gone(name: str) -> NotFoundError:
    return NotFoundError(
        f"the files that '{name}' is made from are no longer stored", remedy="make a new job"
    )
