"""One place for one job at a time: a warm process, and the claims that it works at."""

from __future__ import annotations

import logging
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from service.engines.attempt import AttemptOutcome, InputsDamaged, NotDone, attempt
from service.engines.failures import misread, program_fault, upload_damaged, upload_gone
from service.engines.first_start import FirstStart
from service.engines.idleness import Idleness
from service.engines.life import LifeWatch
from service.engines.messages import Task
from service.engines.process import ProcessDiedError, WorkerProcess
from service.engines.recording import Recorder
from service.engines.signals import Bell, Orders, Running
from service.engines.trouble import StoppedError, Trouble
from service.errors import DiskFullError, NotFoundError, ServiceError
from service.jobs.job import JOURNALS, Claim, Job, JobFile, JobKind, inputs_by_part
from service.jobs.progress import ProgressBoard
from service.jobs.stores import BlobStore, JobStore
from service.keep import Keep
from service.logs import serving_request
from service.settings import Settings
from service.tracing import SpanKind, span

logger = logging.getLogger(__name__)

_GLANCE = 0.05  # seconds between looks at whether to stop
_START_SECONDS = 600.0  # that a process has to get ready: the first one ever compiles the kernels
_LOOK = 1.0  # seconds between looks at an idle process
_PAUSE = 1.0  # seconds after a fault of this program, so that it cannot fill the log


@dataclass(frozen=True)
class Shop:
    """What all slots share.

    ``work``   ``MODULE:FUNCTION`` that a process calls once and that returns what does a task.
    ``on_end``  called with each job that has ended, in a thread of the engine.
    ``threads``  that a job which begins now may use.
    """

    owner: str
    jobs: JobStore
    blobs: BlobStore
    board: ProgressBoard
    settings: Settings
    scratch: Path
    work: str
    on_end: Callable[[Job], None]
    bell: Bell
    running: Running
    trouble: Trouble
    first_start: FirstStart
    idleness: Idleness
    threads: Callable[[], int]

    def end(self, job: Job) -> None:
        """Say that a job has ended; whoever listens cannot hurt the engine."""
        try:
            self.on_end(job)
        except Exception:
            logger.exception("job %s has ended, and somebody failed to hear of it", job.id)


class Slot:
    """Claims jobs and has its process do them until the engine stops.  For a thread of its own.

    The process is kept between jobs, since a fresh one takes seconds to get ready.  It ends with
    the thread.
    """

    def __init__(self, shop: Shop) -> None:
        self._shop = shop
        self._process: WorkerProcess | None = None

    @property
    def live(self) -> bool:
        """Whether its process can do a job or does one.  From any thread."""
        process = self._process
        with suppress(ChildProcessError):  # it was just reaped
            return process is not None and process.ready and process.alive
        return False

    def run(self) -> None:
        """Returns when the engine stops; nothing is raised."""
        trouble = self._shop.trouble
        try:
            while not trouble.stopped:
                try:
                    self._round()
                except StoppedError:
                    return
                except Exception:
                    logger.exception("a worker's thread goes on after a fault of the program")
                    self._discard()
                    trouble.pause(_PAUSE)
        except StoppedError:
            return
        finally:
            self._discard()

    def _round(self) -> None:
        """Get ready, then do a job, if one comes soon."""
        self._ready_process()
        shop = self._shop
        if shop.bell.wait(_LOOK) and self.do_one(
            lambda: shop.jobs.claim(shop.owner, shop.settings.lease_seconds)
        ):
            shop.bell.ring()

    def do_one(self, claiming: Callable[[], Claim | None], starts: int | None = None) -> bool:
        """Claim a job and do it; whether there was one.  For the thread that the process is of.

        ``starts``  how often a process is started before this is given up; None for ever.
        Raises :class:`StoppedError`, :class:`ProcessDiedError` where no process became ready, and
        what ``claiming`` raises but cannot be waited for.
        """
        process, shop = self._ready_process(starts), self._shop
        claim = shop.trouble.insist(claiming)
        if claim is None:
            shop.idleness.look()
            return False
        shop.idleness.begin()
        shop.bell.ring()  # there may be more
        try:
            self._follow(claim, process)
        finally:
            shop.idleness.end()
        return True

    def end(self) -> None:
        """End its process."""
        self._discard()

    def _follow(self, claim: Claim, process: WorkerProcess) -> None:
        """Do a job, as a part of the trace of its request."""
        job = claim.job
        about = {"occluder.job": job.id, "occluder.kind": job.kind, "attempt": job.attempt}
        with (
            serving_request(job.request_id),
            span(f"job {job.kind}", SpanKind.CONSUMER, job.trace, about) as part,
        ):
            self._do(claim, process)
            with suppress(ServiceError):
                part.set_attribute("occluder.state", self._shop.jobs.job(None, job.id).state)

    def _ready_process(self, starts: int | None = None) -> WorkerProcess:
        """A process that can take a task, after however many tries; raises StoppedError."""
        tried = 0
        while True:
            tried += 1
            if self._process is not None and self._is_worn(self._process):
                self._discard()
            if self._process is not None:
                return self._process
            try:
                self._start_process()
            except (ProcessDiedError, OSError) as error:
                self._discard()
                if tried == starts:
                    raise ProcessDiedError(str(error)) from error
                self._shop.trouble.stillborn(str(error))

    def _start_process(self) -> None:
        shop = self._shop
        with shop.first_start.turn(lambda: shop.trouble.pause(0.0)):
            self._process = WorkerProcess(shop.work)
            self._wait_ready(self._process)
            shop.first_start.end()
        shop.trouble.born()

    def _wait_ready(self, process: WorkerProcess) -> None:
        until, life = time.monotonic() + _START_SECONDS, LifeWatch(process)
        silence = self._shop.settings.lease_seconds
        while not process.ready:
            if time.monotonic() >= until:
                raise ProcessDiedError(f"was not ready after {_START_SECONDS:,.0f} seconds")
            if life.silence() >= silence:
                raise ProcessDiedError(f"gave no sign of life for {silence:,.6g} seconds")
            process.receive(_GLANCE)
            self._shop.trouble.pause(0.0)

    def _is_worn(self, process: WorkerProcess) -> bool:
        """Whether a process is to be replaced."""
        settings = self._shop.settings
        return (
            not process.alive
            or process.tasks >= settings.jobs_per_process
            or process.grown > settings.job_memory // 2
        )

    def _discard(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process = None

    def _do(self, claim: Claim, process: WorkerProcess) -> None:
        """Make one attempt, from its claim to its record."""
        shop, job = self._shop, claim.job
        shop.board.announce(job.id)
        recorder = Recorder(shop.jobs, shop.blobs, shop.trouble)
        folder = shop.scratch / f"{job.id}-{job.attempt}"
        results = folder / "results"
        _tell(job, "job %s is begun, attempt %d of %d", job.id, job.attempt, job.attempts)
        with shop.running.at(claim) as orders, removing(folder):
            try:
                outcome = self._attempt(claim, process, folder, orders)
                heard = recorder.record(claim, outcome, results, orders)
            except StoppedError:
                with suppress(ServiceError):  # else the next start takes it back
                    shop.jobs.release(claim)
                raise
            except Exception as error:
                logger.exception("job %s failed by a fault of the program", job.id)
                self._discard()  # it may be at the task still
                failed = NotDone(program_fault(error), final=True)
                heard = recorder.record(claim, failed, results, orders)
        shop.board.end(job.id)
        if heard:
            with suppress(NotFoundError):  # it may be removed as soon as it has ended
                now = shop.jobs.job(None, job.id)
                _tell(now, "job %s is %s after attempt %d", job.id, now.state, job.attempt)
                # Queued again, it may have been done by another attempt by now, which tells of it.
                if now.state.ended:
                    with suppress(OSError):
                        self._journal(job).unlink()
                if now.state.ended and now.attempt == job.attempt:
                    shop.end(now)

    def _attempt(
        self, claim: Claim, process: WorkerProcess, folder: Path, orders: Orders
    ) -> AttemptOutcome:
        shop = self._shop
        try:
            task = shop.trouble.insist(lambda: self._task(claim, folder))
        except KeyError:
            return NotDone(upload_gone(), final=True)
        tell = partial(shop.board.tell, claim.job.id)
        limits = shop.settings.job_seconds, shop.settings.lease_seconds
        outcome = attempt(process, task, *limits, orders, tell)
        if isinstance(outcome, InputsDamaged):
            return self._judge_inputs(claim, outcome)
        return outcome

    def _judge_inputs(self, claim: Claim, told: InputsDamaged) -> NotDone:
        """The process is not taken at its word: its memory may be what is bad."""
        shop, inputs = self._shop, inputs_by_part(claim.inputs)
        blobs = [inputs[name].blob for name in told.inputs]
        if all(shop.trouble.insist(lambda: [shop.blobs.check(blob) for blob in blobs])):
            return NotDone(misread(), final=False)
        return NotDone(upload_damaged(), final=True)

    def _task(self, claim: Claim, folder: Path) -> Task:
        """Everything that the process needs, in an empty folder.

        Raises KeyError when an input is no longer stored, and :class:`DiskFullError`.
        """
        shop, job = self._shop, claim.job
        inputs = laid_out(folder, claim.inputs, shop.blobs)
        digests = {PurePosixPath(one.name).stem: one.blob.digest for one in claim.inputs}
        labels = {
            PurePosixPath(one.name).stem: one.label for one in claim.inputs if one.label is not None
        }
        return Task(
            job.kind, job.name, job.options, inputs, str(folder / "results"),
            str(folder / "scratch"), shop.threads(), shop.settings.job_memory,
            shop.settings.max_unpacked, labels, digests, shop.settings.read_seconds, job.request_id,
            job.keep, shop.settings.draw_at_once and job.keep is Keep.ALL,
            journal=self._begun_journal(job),
        )  # fmt: skip

    def _journal(self, job: Job) -> Path:
        """A file that outlives attempts and servers, on this machine."""
        return self._shop.scratch.with_name(JOURNALS) / job.id

    def _begun_journal(self, job: Job) -> str | None:
        if job.kind is not JobKind.TRADEOFF:
            return None
        path = self._journal(job)
        with _raising_disk_full():
            path.parent.mkdir(mode=0o700, exist_ok=True)
        return str(path)


def _tell(job: Job, message: str, *values: object) -> None:
    fields = {"job": job.id, "kind": job.kind, "state": job.state, "attempt": job.attempt}
    if job.failure is not None:
        fields["failure"] = job.failure.kind
    logger.info(message, *values, extra={"fields": fields})


def laid_out(folder: Path, files: Iterable[JobFile], blobs: BlobStore) -> dict[str, str]:
    """An empty folder for a task, and in it its files: what was sent by the stems of their names,
    what the job has made by their names.

    Raises KeyError when one is no longer stored, and :class:`DiskFullError`.
    """
    paths: dict[str, str] = {}
    with _raising_disk_full():
        shutil.rmtree(folder, ignore_errors=True)
        for place in ("results", "scratch", "input", "made"):
            (folder / place).mkdir(mode=0o700, parents=True)
        for one in files:
            name = PurePosixPath(one.name)
            holder = folder / ("input" if one.is_input else "made")
            file = holder / name.name  # readers go by the suffix; blobs have none
            blobs.lay_out(one.blob, file)
            paths[name.stem if one.is_input else name.name] = str(file)
    return paths


@contextmanager
def removing(folder: Path) -> Iterator[None]:
    """The folder goes at the end, with all that is in it."""
    try:
        yield
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def _raising_disk_full() -> Iterator[None]:
    """Turn what the system refuses into :class:`DiskFullError`, which is waited for to end."""
    try:
        yield
    except OSError as error:
        raise DiskFullError(
            f"no work can be done ({error.strerror})", remedy="free some space for OCCLUDER_DATA"
        ) from error
