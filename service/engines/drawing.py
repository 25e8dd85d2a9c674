"""Draws the pages of jobs when somebody asks for them, by one process of their own.

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
from service.jobs.pages import FINEST, PAGES, REPORT
from service.jobs.stores import BlobStore, JobStore
from service.settings import Settings

logger = logging.getLogger(__name__)

DRAWING_WORK = "service.engines.work.report_files:start_drawing"
"""What the process runs: the library's part is imported there and nowhere else."""

_MOST, _MOST_OF_TENANT = 64, 8
"""Jobs whose pages wait to be drawn."""

_SECONDS = 300.0  # that drawing may take, and that its process may take to start
_IDLE = 60.0  # seconds after which a process that nobody needs is ended
_GLANCE = 0.05  # seconds between looks at a process that starts


@dataclass
class _Asked:
    """A job whose pages are wanted, by one or more."""

    job: Job
    done: Future[None] = field(default_factory=Future)


class Drawer:
    """A :class:`~service.jobs.pages.PageMaker`.  Safe from any thread."""

    def __init__(
        self,
        jobs: JobStore,
        blobs: BlobStore,
        settings: Settings,
        scratch: Path,
        work: str = DRAWING_WORK,
    ) -> None:
        """``scratch`` is on the disk of the blobs."""
        self._jobs, self._blobs, self._settings, self._scratch = jobs, blobs, settings, scratch
        self._work = work
        self._lock = threading.Lock()
        self._asked: dict[str, _Asked] = {}
        self._line: queue.SimpleQueue[_Asked | None] = queue.SimpleQueue()
        self._trouble, self._orders = Trouble(), Orders()
        self._process: WorkerProcess | None = None
        # It starts the process, which dies with it.
        self._thread = threading.Thread(target=self._run, name="occluder pages", daemon=True)

    def start(self) -> None:
        """Returns at once."""
        self._thread.start()

    def stop(self) -> None:
        """End the process; who waits for pages is told to come again."""
        self._trouble.stop()
        self._orders.stop()
        self._line.put(None)
        self._thread.join()
        with self._lock:
            left = list(self._asked.values())
            self._asked.clear()
        for asked in left:
            asked.done.set_exception(NotReadyError("the service ends", remedy="try again later"))

    def draw(self, job: Job) -> Future[None]:
        with self._lock:
            if self._trouble.stopped:
                raise NotReadyError("the service ends", remedy="try again later")
            if job.id in self._asked:
                return self._asked[job.id].done
            of_tenant = sum(one.job.tenant == job.tenant for one in self._asked.values())
            if len(self._asked) >= _MOST or of_tenant >= _MOST_OF_TENANT:
                raise NotReadyError(
                    "the pages of many jobs are being drawn",
                    remedy="try again in a few seconds",
                    headers={"Retry-After": "5"},
                )
            asked = self._asked[job.id] = _Asked(job)
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
        """Draw, and tell all who wait; only the engine's stop is raised."""
        fault: ServiceError | None = None
        try:
            self._draw(asked.job)
        except ServiceError as error:
            fault = error
        except StoppedError:
            raise
        except Exception:
            logger.exception("pages of job %s failed by a fault of the program", asked.job.id)
            self._discard()
            fault = ServiceError("the pages could not be drawn", remedy="try again")
        with self._lock:
            self._asked.pop(asked.job.id, None)
        if fault is None:
            asked.done.set_result(None)
        else:
            asked.done.set_exception(fault)

    def _draw(self, job: Job) -> None:
        files = self._jobs.files(job.id)
        if any(file.name == PAGES["report"] for file in files):
            return  # somebody had them drawn since
        if not files:
            raise _gone()
        folder = self._scratch / f"pages-{job.id}"
        with removing(folder):
            task = self._task(job, files, folder)
            self._do(task)
            with self._blobs.keeping() as keeping:
                recorder = Recorder(self._jobs, self._blobs, self._trouble)
                made = recorder.store_files(keeping, folder / "results")
                if not self._jobs.add_pages(job.id, made):
                    raise _gone()

    def _task(self, job: Job, files: Sequence[JobFile], folder: Path) -> Task:
        needed = [file for file in files if file.is_input or file.name in (FINEST, REPORT)]
        try:
            inputs = laid_out(folder, needed, self._blobs)
        except KeyError:
            raise _gone() from None
        labels = {PurePosixPath(one.name).stem: one.label for one in needed if one.label}
        return Task(
            job.kind, job.name, job.options, inputs, str(folder / "results"),
            str(folder / "scratch"), 1, self._settings.job_memory, self._settings.max_unpacked,
            labels,
        )  # fmt: skip

    def _do(self, task: Task) -> None:
        try:
            process = self._ready_process()
            silence = self._settings.lease_seconds
            outcome = attempt(process, task, _SECONDS, silence, self._orders, lambda progress: None)
        except (ProcessDiedError, OSError) as error:
            self._discard()
            raise NotReadyError(
                f"pages cannot be drawn now ({error})", remedy="try again"
            ) from error
        match outcome:
            case Succeeded():
                return
            case GivenUp():
                raise StoppedError
            case Hindered():
                raise DiskFullError("there is no room for pages", remedy=outcome.failure.remedy)
            case NotDone() if outcome.final:
                failure = outcome.failure
                raise JobFailedError(
                    f"the pages could not be drawn: {failure.detail}", remedy=failure.remedy
                )
            case NotDone():
                raise NotReadyError(
                    f"the pages could not be drawn: {outcome.failure.detail}", remedy="try again"
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


def _gone() -> NotFoundError:
    return NotFoundError("what the pages are drawn from is stored no more", remedy="make a new job")
