"""One try at a job by a warm process, from handing over to what came of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from service.engines.failures import (
    is_disk_full,
    out_of_memory,
    out_of_reading_time,
    out_of_time,
    process_died,
    process_silent,
)
from service.engines.life import LifeWatch
from service.engines.messages import Answer, Cancelled, Damaged, Done, Failed, Task, TaskProgress
from service.engines.process import ProcessDiedError, WorkerProcess
from service.engines.signals import Orders
from service.jobs.job import Failure, Summary
from service.jobs.progress import READING, JobProgress

_GLANCE = 0.05  # seconds between looks at orders and limits
_PATIENCE = 0.5  # seconds that a process has to end its task when it is told to
_READING_PATIENCE = 1.0  # seconds that it has to end reading by itself, before it is ended


@dataclass(frozen=True)
class Succeeded:
    """The files are in the task's folder."""

    summary: Summary


@dataclass(frozen=True)
class NotDone:
    """Why there is no result; unless it is ``final``, another try may have one."""

    failure: Failure
    final: bool


@dataclass(frozen=True)
class Hindered:
    """This machine had no room for it, which is no fault of the job's: later it may have."""

    failure: Failure


@dataclass(frozen=True)
class InputsDamaged:
    """Inputs, by name, that the process read otherwise than they were stored."""

    inputs: tuple[str, ...]


@dataclass(frozen=True)
class GivenUp:
    """It was told to end: the orders say why."""


AttemptOutcome = Succeeded | NotDone | Hindered | GivenUp


def attempt(
    process: WorkerProcess,
    task: Task,
    seconds: float,
    silence: float,
    orders: Orders,
    tell: Callable[[JobProgress], None],
) -> AttemptOutcome | InputsDamaged:
    """Have a task done within some seconds and the memory that it says.

    A process without a sign of life for ``silence`` seconds is taken for lost.
    A process that cannot be used any more afterwards has been ended.
    """
    process.send(task)
    watch = _Watch(process, task, seconds, silence, orders)
    try:
        while True:
            answer = process.receive(_GLANCE)
            if isinstance(answer, TaskProgress):
                watch.note(answer.progress.stage)
                tell(answer.progress)
            elif answer is not None:
                return _outcome(process, answer, orders)
            ended = watch.glance()
            if ended is not None:
                process.kill()
                return ended
    except ProcessDiedError as death:
        if orders.cancelled or orders.dropped:
            return GivenUp()
        return NotDone(process_died(str(death)), final=False)


def _outcome(
    process: WorkerProcess, answer: Answer, orders: Orders
) -> AttemptOutcome | InputsDamaged:
    match answer:
        case Damaged():
            return InputsDamaged(answer.inputs)
        case Done():
            return Succeeded(answer.summary)
        case Failed():
            if answer.odd:
                process.kill()
            if is_disk_full(answer.failure):
                return Hindered(answer.failure)
            return NotDone(answer.failure, final=True)
        case Cancelled() if orders.cancelled or orders.dropped:
            return GivenUp()
        case _:
            process.kill()
            raise ProcessDiedError("answered out of turn")


class _Watch:
    """Looks at a running attempt now and then, and says when it has to end."""

    def __init__(
        self,
        process: WorkerProcess,
        task: Task,
        seconds: float,
        silence: float,
        orders: Orders,
    ) -> None:
        self._process, self._task, self._seconds, self._orders = process, task, seconds, orders
        self._life, self._silence = LifeWatch(process), silence
        self._up = time.monotonic() + seconds
        self._patient_until: float | None = None
        self._reading_since: float | None = None

    def note(self, stage: str) -> None:
        """The process has come to a stage, or is at it still."""
        if stage != READING:
            self._reading_since = None
        elif self._reading_since is None:
            self._reading_since = time.monotonic()

    def glance(self) -> AttemptOutcome | None:
        """What the attempt ends with here and now; None while it may go on."""
        now = time.monotonic()
        if self._orders.stopped:
            return GivenUp()
        if self._orders.cancelled or self._orders.dropped:
            if self._patient_until is None:
                self._patient_until = now + _PATIENCE
                self._process.cancel()
            return GivenUp() if now >= self._patient_until else None
        if now >= self._up:
            return NotDone(out_of_time(self._seconds), final=True)
        if self._reads_too_long(now):
            return NotDone(out_of_reading_time(self._task.reading or 0.0), final=True)
        if self._life.silence() >= self._silence:
            return NotDone(process_silent(self._silence), final=False)
        if self._process.grown > self._task.memory:
            return NotDone(out_of_memory(self._task.memory), final=True)
        return None

    def _reads_too_long(self, now: float) -> bool:
        """It ends that itself, but within a long call of a library it hears of nothing."""
        if self._reading_since is None or self._task.reading is None:
            return False
        return now >= self._reading_since + self._task.reading + _READING_PATIENCE
